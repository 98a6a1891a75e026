#include "material_tests/drape.h"

#include <algorithm>
#include <cmath>

#include "material_tests/disc_energy.h"

namespace selvedge::material_tests {

namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kYields = 10;
constexpr double kLongest_m = 0.01;  // of a step
// Mass is added to the curvature by these, 1/s²: at least, at most, from where the convex curvature serves better, and
// where a small step means rest.
constexpr double kLeastInertia_per_s2 = 3, kMostInertia_per_s2 = 1e8, kConvexFrom_per_s2 = 3e3, kFewest_per_s2 = 100;

Matrix3Xd moved(const DiscEnergy& energy, Matrix3Xd control, const VectorXd& step, double share) {
  for (Index i = 0; i < control.cols(); ++i)
    if (const Index at = energy.place(i); at >= 0) control.col(i) += share * step.segment<3>(at);
  return control;
}

double longest(const VectorXd& step) { return step.reshaped(3, step.size() / 3).colwise().norm().maxCoeff(); }

// Along the fabric, from the support outwards to s, it falls from flat to its droop. (out, up), m.
Eigen::Vector2d drooping(double s, double length_m, double droop_rad, double less = 0) {
  constexpr int parts = 24;
  Eigen::Vector2d x(0, 0);
  for (int i = 0; i < parts; ++i) {
    const double here = (i + 0.5) / parts * s / length_m;
    const double droop = droop_rad * (1 - std::exp(-3 * here)) * (1 - less * here);
    x += s / parts * Eigen::Vector2d(std::cos(droop), -std::sin(droop));
  }
  return x;
}

Vector3d placed_round(const Disc& disc, const Eigen::Vector2d& x, double angle) {
  const double r = disc.support_radius_m + x.x();
  return {r * std::cos(angle), r * std::sin(angle), x.y()};
}

}  // namespace

Matrix3Xd folded(const DiscSheet& sheet, int folds, double phase_rad, double droop_rad) {
  const Disc& disc = sheet.disc();
  const double length = disc.radius_m - disc.support_radius_m;
  return sheet.control_of([&](double r, double angle) {
    const double less = 0.45 * std::cos(folds * (angle - phase_rad));
    return placed_round(disc, drooping(r - disc.support_radius_m, length, droop_rad, less), angle);
  });
}

Matrix3Xd hanging(const DiscSheet& sheet, const VectorXd& radius_m) {
  const Disc& disc = sheet.disc();
  const double length = disc.radius_m - disc.support_radius_m;
  return sheet.control_of([&](double r, double angle) {
    const Index at = std::lround(angle / (2 * M_PI) * double(radius_m.size())) % radius_m.size();
    double low = 0, high = 1.9;  // rad: the rim's radius falls as droop grows
    for (int i = 0; i < 30; ++i) {
      const double middle = (low + high) / 2;
      const bool out = disc.support_radius_m + drooping(length, length, middle).x() > radius_m(at);
      (out ? low : high) = middle;
    }
    return placed_round(disc, drooping(r - disc.support_radius_m, length, low), angle);
  });
}

Drape drape_like(const DiscSheet& sheet, const cloth::Material& material, const VectorXd& radius_m) {
  cloth::Material yielding = material;
  yielding.stretch /= kYields;
  yielding.shear /= kYields;
  const Drape near = come_to_rest(sheet, yielding, hanging(sheet, radius_m), {.change_m = 5e-3});
  return come_to_rest(sheet, material, near.control, {.change_m = 2e-4, .inertia_per_s2 = 300});
}

Drape come_to_rest(const DiscSheet& sheet, const cloth::Material& material, const Matrix3Xd& start,
                   const RestOptions& options) {
  const DiscEnergy energy(sheet, material);
  const VectorXd mass = energy.masses();
  RingMatrix curvature = energy.empty_curvature();
  Drape out{start, false, 0, 0};
  VectorXd slope;
  double inertia = options.inertia_per_s2;
  for (; out.steps < options.most_steps; ++out.steps) {
    out.energy_j = energy.derivatives(out.control, false, slope, curvature);
    if (!std::isfinite(out.energy_j)) return out;
    bool convex = false;
    while (!convex && !curvature.factorise(inertia * mass)) convex = (inertia *= 4) > kConvexFrom_per_s2;
    if (convex) {
      energy.derivatives(out.control, true, slope, curvature);
      while (!curvature.factorise(inertia * mass))
        if ((inertia *= 10) > kMostInertia_per_s2) return out;
    }
    const VectorXd step = curvature.solve(-slope);
    const double length = longest(step);
    if (length < options.change_m && inertia <= kFewest_per_s2) {
      out.at_rest = true;
      return out;
    }
    const double push = step.dot(slope);
    double share = std::min(1.0, kLongest_m / length);
    int halved = 0;
    for (; halved < 12; ++halved, share /= 2) {
      const Matrix3Xd there = moved(energy, out.control, step, share);
      if (energy.value(there) <= out.energy_j + 1e-4 * share * push + 1e-15) {
        out.control = there;
        break;
      }
    }
    inertia = halved > 0 ? std::min(inertia * 4, kMostInertia_per_s2)
                         : std::max(inertia / (convex ? 2 : 4), kLeastInertia_per_s2);
    if (halved == 12 && length < 10 * options.change_m) return out;
  }
  return out;
}

}  // namespace selvedge::material_tests
