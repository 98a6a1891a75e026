#include "cloth/sheet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include <Eigen/Dense>

#include "cloth/bend_matrix.h"
#include "cloth/bordered_sheet.h"
#include "geometry/grip.h"

namespace selvedge::cloth {

namespace {

kernel::Triangle make_triangle(const geometry::TriangleMesh& mesh, const std::array<int, 3>& corners) {
  kernel::Triangle t{};
  Eigen::Matrix2d sides;
  const auto at = [&](int k) { return mesh.rest_uv[static_cast<size_t>(corners[static_cast<size_t>(k)])]; };
  sides << at(1) - at(0), at(2) - at(0);
  const double twice_area = std::abs(sides.determinant());
  if (!(twice_area > 0)) throw std::invalid_argument("make_sheet: a triangle has no area");
  const Eigen::Matrix2d inverse = sides.inverse();  // rows: gradients of the shape functions of corners 1, 2
  for (int k = 0; k < 3; ++k) t.vertex[k] = corners[static_cast<size_t>(k)];
  for (int k = 1; k < 3; ++k) {
    t.gradient_u[k] = inverse(k - 1, 0);
    t.gradient_v[k] = inverse(k - 1, 1);
  }
  t.gradient_u[0] = -t.gradient_u[1] - t.gradient_u[2];
  t.gradient_v[0] = -t.gradient_v[1] - t.gradient_v[2];
  t.membrane_area = twice_area / 2;
  return t;
}

// Parts of a flat triangle that lie nearest to each corner (Meyer et al. 2003: Voronoi's, and where a corner is
// obtuse half of the area for it). A third each would give the vertices of a grid with alternating diagonals
// areas of 4/3 and 2/3 cells in turn, and a sheet finds the soft half of such a pattern when it bends: 5.6 %
// less rigidity, on however fine a mesh.
std::array<double, 3> corner_areas(const geometry::TriangleMesh& mesh, const std::array<int, 3>& corners, double area) {
  std::array<Eigen::Vector2d, 3> side;  // opposite to each corner
  for (size_t k = 0; k < 3; ++k)
    side[k] = mesh.rest_uv[static_cast<size_t>(corners[(k + 2) % 3])] -
              mesh.rest_uv[static_cast<size_t>(corners[(k + 1) % 3])];
  std::array<double, 3> cotangent;
  for (size_t k = 0; k < 3; ++k) cotangent[k] = -side[(k + 1) % 3].dot(side[(k + 2) % 3]) / (2 * area);
  std::array<double, 3> out;
  for (size_t k = 0; k < 3; ++k) {
    const size_t a = (k + 1) % 3, b = (k + 2) % 3;
    if (cotangent[k] < 0) out[k] = area / 2;
    else if (cotangent[a] < 0 || cotangent[b] < 0) out[k] = area / 4;
    else out[k] = (side[a].squaredNorm() * cotangent[a] + side[b].squaredNorm() * cotangent[b]) / 8;
  }
  return out;
}

// Second derivatives at `centre` from the neighbours within `radius`: weighted least squares for the five
// coefficients of a quadratic through the centre. Empty where they do not determine it well.
Eigen::Matrix<double, 3, Eigen::Dynamic> fit_quadratic(const std::vector<Eigen::Vector2d>& uv, int centre,
                                                       const std::vector<int>& neighbours, double spacing) {
  const auto count = static_cast<Eigen::Index>(neighbours.size());
  if (count < 7) return {};
  Eigen::MatrixXd design(count, 5);
  Eigen::VectorXd weight(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Vector2d d =
        (uv[static_cast<size_t>(neighbours[static_cast<size_t>(k)])] - uv[static_cast<size_t>(centre)]) / spacing;
    weight(k) = std::exp(-0.5 * d.squaredNorm());
    design.row(k) << d.x(), d.y(), 0.5 * d.x() * d.x(), d.x() * d.y(), 0.5 * d.y() * d.y();
    design.row(k) *= weight(k);
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(design, Eigen::ComputeThinU | Eigen::ComputeThinV);
  if (svd.singularValues()(4) < 0.05 * svd.singularValues()(0)) return {};
  const Eigen::MatrixXd inverse = svd.solve(Eigen::MatrixXd(weight.asDiagonal()));  // 5 × count
  return inverse.bottomRows<3>() / (spacing * spacing);
}

void add_stencil(kernel::BendStencils& bend, const std::vector<Eigen::Vector2d>& uv, int centre, double spacing) {
  for (double reach = 1.6; reach < 4.5; reach += 0.3) {
    std::vector<int> neighbours;
    for (size_t j = 0; j < uv.size(); ++j)
      if (static_cast<int>(j) != centre && (uv[j] - uv[static_cast<size_t>(centre)]).norm() < reach * spacing)
        neighbours.push_back(static_cast<int>(j));
    const auto rows = fit_quadratic(uv, centre, neighbours, spacing);
    if (rows.cols() == 0) continue;
    for (size_t k = 0; k < neighbours.size(); ++k) {
      bend.index.push_back(neighbours[k]);
      bend.uu.push_back(rows(0, static_cast<Eigen::Index>(k)));
      bend.uv.push_back(rows(1, static_cast<Eigen::Index>(k)));
      bend.vv.push_back(rows(2, static_cast<Eigen::Index>(k)));
    }
    bend.index.push_back(centre);
    bend.uu.push_back(-rows.row(0).sum());
    bend.uv.push_back(-rows.row(1).sum());
    bend.vv.push_back(-rows.row(2).sum());
    bend.start.push_back(static_cast<int>(bend.index.size()));
    return;
  }
  throw std::invalid_argument("make_sheet: too few vertices for second derivatives");
}

double mean_spacing(const kernel::SheetData& s) {
  const double area = std::accumulate(s.vertex_area.begin(), s.vertex_area.end(), 0.0);
  return std::sqrt(2 * area / static_cast<double>(s.triangles.size()));
}

// The two corners by which a rig holds; a sheet held otherwise does not feel so few triangles.
void give_held_corners_the_grips_size(const geometry::TriangleMesh& mesh, kernel::SheetData& s) {
  const double softness = geometry::grip_softness(mean_spacing(s));
  for (const double u : {0.0, mesh.width_m}) {
    const int corner = geometry::nearest_vertex(mesh, {u, 0});
    for (kernel::Triangle& t : s.triangles)
      if (std::find(t.vertex, t.vertex + 3, corner) != t.vertex + 3) t.membrane_area *= softness;
  }
}

// The metric by which arcs exceed chords, as weights of the products of second derivatives.
kernel::ArcWeights<double> arc_weights(const geometry::TriangleMesh& mesh, const std::array<int, 3>& corners) {
  Eigen::Matrix3d metric_of_sides;              // squares of the sides = this · (δ_uu, δ_uv, δ_vv)
  Eigen::Matrix<double, 3, 6> square_of_sides;  // |c|²/12 of the sides = this · products
  for (int k = 0; k < 3; ++k) {
    const auto at = [&](int corner) {
      return mesh.rest_uv[static_cast<size_t>(corners[static_cast<size_t>(corner % 3)])];
    };
    const Eigen::Vector2d d = at(k + 2) - at(k + 1);
    const double uu = d.x() * d.x(), uv = d.x() * d.y(), vv = d.y() * d.y();
    metric_of_sides.row(k) << uu, 2 * uv, vv;
    square_of_sides.row(k) << uu * uu, 4 * uu * uv, 2 * uu * vv, 4 * uv * uv, 4 * uv * vv, vv * vv;
  }
  const Eigen::Matrix<double, 3, 6> metric = metric_of_sides.inverse() * square_of_sides / 12;
  kernel::ArcWeights<double> out{};
  for (int k = 0; k < 6; ++k) {
    out.u[k] = 0.5 * metric(0, k);
    out.shear[k] = metric(1, k);
    out.v[k] = 0.5 * metric(2, k);
  }
  return out;
}

}  // namespace

Sheet make_sheet(const geometry::TriangleMesh& mesh, Sides sides) {
  Sheet sheet = make_bordered_sheet(mesh, static_cast<int>(mesh.rest_uv.size()));
  give_held_corners_the_grips_size(mesh, sheet.data);
  if (sides == Sides::arcs)
    for (const auto& corners : mesh.triangles) sheet.data.arcs.push_back(arc_weights(mesh, corners));
  return sheet;
}

Sheet make_bordered_sheet(const geometry::TriangleMesh& mesh, int own) {
  Sheet sheet;
  sheet.mesh = mesh;
  kernel::SheetData& s = sheet.data;
  s.vertex_count = static_cast<int>(mesh.rest_uv.size());
  s.width_m = mesh.width_m;
  s.height_m = mesh.height_m;
  s.vertex_area.assign(mesh.rest_uv.size(), 0);
  for (const auto& corners : mesh.triangles) {
    s.triangles.push_back(make_triangle(mesh, corners));
    const std::array<double, 3> parts = corner_areas(mesh, corners, s.triangles.back().membrane_area);
    for (size_t k = 0; k < 3; ++k) {
      s.triangles.back().corner_area[k] = parts[k];
      s.vertex_area[static_cast<size_t>(corners[k])] += parts[k];
    }
  }
  for (const Eigen::Vector2d& uv : mesh.rest_uv) {
    s.vertex_u.push_back(uv.x());
    s.vertex_v.push_back(uv.y());
    s.rim_distance.push_back(std::max(0.0, std::min({uv.x(), mesh.width_m - uv.x(), uv.y(), mesh.height_m - uv.y()})));
  }
  const double spacing = mean_spacing(s);
  s.bend.start.push_back(0);
  for (int i = 0; i < own; ++i) add_stencil(s.bend, mesh.rest_uv, i, spacing);
  s.bend.start.resize(static_cast<size_t>(s.vertex_count) + 1, s.bend.start.back());
  s.bend_matrix = make_bend_matrix(s);
  return sheet;
}

}  // namespace selvedge::cloth
