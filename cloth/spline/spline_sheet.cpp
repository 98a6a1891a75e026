#include "cloth/spline/spline_sheet.h"

#include <algorithm>
#include <cmath>

#include "cloth/spline/interpolation.h"

namespace selvedge::cloth::spline {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

enum class Fine { nowhere, first_end, both_ends };

// Cells that grow from rim_share of the largest at an end to the largest a quarter of the way in.
std::vector<double> graded(double length, double cell, double rim_share, Fine fine) {
  const auto size = [&](double x) {
    if (fine == Fine::nowhere) return 1.0;
    const double from_end = fine == Fine::first_end ? x : std::min(x, 1 - x);
    return rim_share + (1 - rim_share) * std::min(1.0, from_end / 0.25);
  };
  // ∫ dx / size(x) is the number of cells, in units of length / cell; breaks lie at its equal parts.
  const int fineness = 4000;
  std::vector<double> sum = {0};
  for (int k = 0; k < fineness; ++k) sum.push_back(sum.back() + 1 / (size((k + 0.5) / fineness) * fineness));
  const int cells = std::max(4, static_cast<int>(std::lround(sum.back() * length / cell)));
  std::vector<double> breaks = {0};
  for (int c = 1; c < cells; ++c) {
    const double wanted = sum.back() * c / cells;
    const auto above = std::upper_bound(sum.begin(), sum.end(), wanted);
    const auto k = static_cast<double>(above - sum.begin());
    breaks.push_back(length * (k - (*above - wanted) / (*above - *(above - 1))) / fineness);
  }
  breaks.push_back(length);
  for (size_t c = 0; fine == Fine::both_ends && c < breaks.size() / 2; ++c)
    breaks[breaks.size() - 1 - c] = length - breaks[c];  // rounding aside they are
  return breaks;
}

Side make_side(std::vector<double> breaks) {
  Side side{Basis(std::move(breaks)), {}, {}, {}, {}, {}, {}};
  side.rule = side.basis.gauss(1, 3);
  for (const double x : side.rule.at) side.alive.push_back(side.basis.at(x));
  side.mass = products(side.basis, 0);
  side.slope = products(side.basis, 1);
  side.bend = products(side.basis, 2);
  side.inverse = corrected_inverse_mass(side.basis);
  return side;
}

// Largest eigenvalue of (R ⊗ R)(bend ⊗ mass + 2 slope ⊗ slope + mass ⊗ bend), by power iteration.
double largest_bending(const Side& u, const Side& v) {
  MatrixXd y(u.basis.count(), v.basis.count());
  for (Index i = 0; i < y.size(); ++i) y(i) = std::sin(12.9898 * static_cast<double>(i + 1)) + (i % 2 ? 0.5 : -0.5);
  double value = 0;
  for (int k = 0; k < 60; ++k) {
    y /= y.norm();
    const MatrixXd force = u.bend * y * v.mass + 2 * u.slope * y * v.slope + u.mass * y * v.bend;
    y = u.inverse * force * v.inverse;
    value = y.norm();
  }
  return 1.03 * value;  // from below
}

}  // namespace

Grid make_grid(const Swatch& swatch, Hold hold, double cell_m, double rim_share) {
  const bool corners = hold == Hold::corners, sides = hold == Hold::side_edges, top = hold != Hold::nothing && !sides;
  return {graded(swatch.width_m, cell_m, rim_share, corners || sides ? Fine::both_ends : Fine::nowhere),
          graded(swatch.height_m, cell_m, rim_share, top ? Fine::first_end : Fine::nowhere)};
}

SplineSheet make_spline_sheet(const Swatch& swatch, const Grid& grid) {
  SplineSheet sheet{swatch, make_side(grid.u), make_side(grid.v)};
  sheet.bend_omega2 = largest_bending(sheet.u, sheet.v);
  return sheet;
}

SurfacePoint surface_point(const SplineSheet& sheet, const Eigen::Vector2d& uv) {
  const Alive a = sheet.u.basis.at(uv.x()), b = sheet.v.basis.at(uv.y());
  SurfacePoint out;
  for (int r = 0; r <= kDegree; ++r)
    for (int c = 0; c <= kDegree; ++c) {
      out.vertices.push_back(sheet.index(a.first + c, b.first + r));
      out.weights.push_back(a.of[0][static_cast<size_t>(c)] * b.of[0][static_cast<size_t>(r)]);
    }
  return out;
}

double rim_distance(const Swatch& s, const Eigen::Vector2d& uv) {
  return std::max(0.0, std::min({uv.x(), s.width_m - uv.x(), uv.y(), s.height_m - uv.y()}));
}

std::vector<Eigen::Vector2d> greville_points(const SplineSheet& sheet) {
  std::vector<Eigen::Vector2d> out;
  for (int r = 0; r < sheet.rows(); ++r)
    for (int c = 0; c < sheet.columns(); ++c) out.emplace_back(sheet.u.basis.greville(c), sheet.v.basis.greville(r));
  return out;
}

Eigen::Matrix3Xd control_points_through(const SplineSheet& sheet,
                                        const std::function<Eigen::Vector3d(const Eigen::Vector2d&)>& shape) {
  const std::vector<Eigen::Vector2d> points = greville_points(sheet);
  Eigen::Matrix3Xd out(3, sheet.count());
  for (Index i = 0; i < out.cols(); ++i) out.col(i) = shape(points[static_cast<size_t>(i)]);
  Interpolation(sheet.u.basis, sheet.v.basis).solve(out);
  return out;
}

Eigen::Matrix3Xd carried_over(const SplineSheet& from, const Eigen::Matrix3Xd& control, const SplineSheet& to) {
  return control_points_through(
      to, [&](const Eigen::Vector2d& uv) { return position_of(surface_point(from, uv), control); });
}

}  // namespace selvedge::cloth::spline
