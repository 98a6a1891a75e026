#include "material_tests/disc_sheet.h"

#include <cmath>
#include <stdexcept>

namespace selvedge::material_tests {

namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kTurn = 2 * M_PI;
constexpr double kWidening = 1.6;  // i-th of n breaks at the (i/n)^1.6-th part of the length

// The four uniform cubic B-splines alive at share t of a cell, with two derivatives by t.
std::array<std::array<double, 4>, 3> uniform(double t) {
  const double s = 1 - t;
  return {{{s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6},
           {-s * s / 2, (9 * t * t - 12 * t) / 6, (-9 * s * s + 12 * s) / 6, t * t / 2},
           {s, 3 * t - 2, 3 * s - 2, t}}};
}

std::vector<double> widening_breaks(double length_m, int cells) {
  std::vector<double> breaks;
  for (int i = 0; i <= cells; ++i) breaks.push_back(length_m * std::pow(static_cast<double>(i) / cells, kWidening));
  return breaks;
}

struct Around {
  int first;
  std::array<std::array<double, 4>, 3> of;  // [order][function], 1/rad^order
};

Around around(int spokes, double angle_rad) {
  const double cell = kTurn / spokes, place = angle_rad / cell;
  const int first = static_cast<int>(std::floor(place));
  Around a{first - 1, uniform(place - first)};
  for (size_t i = 0; i < 4; ++i) {
    a.of[1][i] /= cell;
    a.of[2][i] /= cell * cell;
  }
  return a;
}

}  // namespace

DiscSheet::DiscSheet(const Disc& disc, int cells, int spokes)
    : disc_(disc), spokes_(spokes), radial_(widening_breaks(disc.radius_m - disc.support_radius_m, cells)) {
  if (spokes < 12 || spokes % 3 != 0)
    throw std::invalid_argument("DiscSheet: spokes " + std::to_string(spokes) + ", expected a multiple of 3 from 12");
  const double half = 0.5 / std::sqrt(3.0);
  membrane_ = points_of(radial_.gauss(1, 2), {0.5});
  bending_ = points_of(radial_.gauss(2, 2), {0.5 - half, 0.5 + half});
  add_areas();
}

double DiscSheet::angle_of(int spoke) const { return kTurn * spoke / spokes_; }

std::vector<DiscPoint> DiscSheet::points_of(const cloth::spline::Rule& along, const std::vector<double>& shares) const {
  std::vector<DiscPoint> points;
  const double cell = kTurn / spokes_;
  for (int j = 0; j < spokes_; ++j)
    for (const double share : shares)
      for (size_t i = 0; i < along.at.size(); ++i) {
        const double r = disc_.support_radius_m + along.at[i], angle = (j + share) * cell;
        const double c = std::cos(angle), s = std::sin(angle);
        const cloth::spline::Alive n = radial_.at(along.at[i]);
        const Around m = around(spokes_, angle);
        DiscPoint p;
        p.weight = along.weight[i] * r * cell / static_cast<double>(shares.size());
        p.first_ring = n.first;
        p.first_spoke = m.first;
        for (size_t k = 0; k < 16; ++k) {
          const size_t a = k / 4, b = k % 4;
          const double fr = m.of[0][a] * n.of[1][b], ft = m.of[1][a] * n.of[0][b] / r, rr = m.of[0][a] * n.of[2][b];
          const double across = m.of[1][a] * n.of[1][b] / r - ft / r,
                       round = m.of[2][a] * n.of[0][b] / (r * r) + fr / r;
          p.u[k] = c * fr - s * ft;
          p.v[k] = s * fr + c * ft;
          p.uu[k] = c * c * rr - 2 * s * c * across + s * s * round;
          p.vv[k] = s * s * rr + 2 * s * c * across + c * c * round;
          p.uv[k] = s * c * (rr - round) + (c * c - s * s) * across;
        }
        points.push_back(p);
      }
  return points;
}

void DiscSheet::add_areas() {
  areas_ = Eigen::VectorXd::Zero(count());
  const cloth::spline::Rule along = radial_.gauss(3, 3);
  for (size_t i = 0; i < along.at.size(); ++i) {
    const cloth::spline::Alive n = radial_.at(along.at[i]);
    for (int j = 0; j < spokes_; ++j)
      for (int b = 0; b < 4; ++b)
        areas_(index(j, n.first + b)) += along.weight[i] * (disc_.support_radius_m + along.at[i]) * kTurn / spokes_ *
                                         n.of[0][static_cast<size_t>(b)];
  }
}

double DiscSheet::outward() const { return 6 / (4 + 2 * std::cos(kTurn / spokes_)); }

void DiscSheet::hold(Matrix3Xd& control) const {
  for (int j = 0; j < spokes_; ++j)
    for (int k = 0; k < kHeldRings; ++k) {
      const double r = outward() * radius_of(k), angle = angle_of(j);
      control.col(index(j, k)) = Vector3d(r * std::cos(angle), r * std::sin(angle), 0);
    }
}

Vector3d DiscSheet::at(const Matrix3Xd& control, double radius_m, double angle_rad) const {
  const cloth::spline::Alive n = radial_.at(radius_m - disc_.support_radius_m);
  const Around m = around(spokes_, angle_rad);
  Vector3d x = Vector3d::Zero();
  for (size_t a = 0; a < 4; ++a)
    for (size_t b = 0; b < 4; ++b)
      x += m.of[0][a] * n.of[0][b] * control.col(index(m.first + static_cast<int>(a), n.first + static_cast<int>(b)));
  return x;
}

Matrix3Xd DiscSheet::grid(const Matrix3Xd& control, int around, int along) const {
  Matrix3Xd out(3, Eigen::Index(around) * along);
  for (int j = 0; j < around; ++j)
    for (int k = 0; k < along; ++k)
      out.col(Eigen::Index(j) * along + k) =
          at(control, disc_.support_radius_m + (disc_.radius_m - disc_.support_radius_m) * k / (along - 1),
             kTurn * j / around);
  return out;
}

}  // namespace selvedge::material_tests
