#include "material_tests/heavy_strip.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <boost/math/tools/roots.hpp>

namespace selvedge::material_tests {

namespace {

struct Slope {
  double angle = 0, moment = 0;
};

double most_moment(const BendingLaw& law) {
  return law.second_order < 0 ? -law.bend * law.bend / (4 * law.second_order) : std::numeric_limits<double>::infinity();
}

// Beyond the largest moment a steep straight line, so that a search may pass there.
double curvature_of(const BendingLaw& law, double moment) {
  if (law.second_order == 0) return moment / law.bend;
  const double most = most_moment(law);
  const double inside = std::min(moment, most);
  const double root = std::sqrt(std::max(0.0, law.bend * law.bend + 4 * law.second_order * inside));
  return 2 * inside / (law.bend + root) + (moment - inside) / (0.05 * law.bend);
}

// The strip from its tip, which slopes by tip_angle, back to the edge: `steps` of the classical Runge–Kutta method.
template <class Visit>
Slope integrate(const BendingLaw& law, double weight, double overhang_m, int steps, double tip_angle,
                const Visit& visit) {
  const double h = overhang_m / steps;
  Slope at{tip_angle, 0};
  const auto rate = [&](const Slope& x, double to_tip) {
    return Slope{-curvature_of(law, x.moment), weight * to_tip * std::cos(x.angle)};
  };
  const auto moved = [](const Slope& x, const Slope& by, double step) {
    return Slope{x.angle + step * by.angle, x.moment + step * by.moment};
  };
  for (int k = 0; k < steps; ++k) {
    const double to_tip = k * h;
    const Slope a = rate(at, to_tip), b = rate(moved(at, a, h / 2), to_tip + h / 2),
                c = rate(moved(at, b, h / 2), to_tip + h / 2), d = rate(moved(at, c, h), to_tip + h);
    const Slope next{at.angle + h / 6 * (a.angle + 2 * b.angle + 2 * c.angle + d.angle),
                     at.moment + h / 6 * (a.moment + 2 * b.moment + 2 * c.moment + d.moment)};
    visit(k, at, next);
    at = next;
  }
  return at;
}

}  // namespace

std::optional<HangingStrip> hanging_strip(const BendingLaw& law, double weight, double overhang_m, int steps) {
  const auto pass = [](int, const Slope&, const Slope&) {};
  const auto edge_slope = [&](double tip) { return integrate(law, weight, overhang_m, steps, tip, pass).angle; };
  // A tip that hangs straight down leaves the edge so too; one that does not slope leaves it upwards.
  std::uintmax_t most = 80;
  const auto [low, high] =
      boost::math::tools::toms748_solve(edge_slope, 0.0, std::numbers::pi / 2, edge_slope(0), std::numbers::pi / 2,
                                        boost::math::tools::eps_tolerance<double>(48), most);
  HangingStrip strip;
  Eigen::Matrix2Xd to_tip(2, steps + 1);  // from the tip back
  to_tip.col(0).setZero();
  const double h = overhang_m / steps;
  // Over a step the slope is a cubic of its ends and their rates: Simpson's rule with its middle.
  const Slope edge =
      integrate(law, weight, overhang_m, steps, 0.5 * (low + high), [&](int k, const Slope& from, const Slope& to) {
        const double turn = curvature_of(law, to.moment) - curvature_of(law, from.moment);
        const double middle = 0.5 * (from.angle + to.angle) + h / 8 * turn;
        const auto simpson = [&](auto f) { return h / 6 * (f(from.angle) + 4 * f(middle) + f(to.angle)); };
        to_tip.col(k + 1) << to_tip(0, k) + simpson([](double a) { return std::cos(a); }),
            to_tip(1, k) + simpson([](double a) { return std::sin(a); });
      });
  if (edge.moment > most_moment(law)) return std::nullopt;
  strip.edge_curvature = curvature_of(law, edge.moment);
  strip.point_m = (to_tip.col(steps).replicate(1, steps + 1) - to_tip).rowwise().reverse();
  return strip;
}

double bending_length(const BendingLaw& law, double weight) { return std::cbrt(law.bend / weight); }

std::optional<double> instrument_bending_length(const BendingLaw& law, double weight) {
  constexpr double kPlane = 41.5 * std::numbers::pi / 180;
  const double c = bending_length(law, weight);
  bool folds = false;
  const auto beyond = [&](double overhang) {
    const auto strip = hanging_strip(law, weight, overhang);
    if (!strip) return folds = true, 1.0;
    const Eigen::Vector2d tip = strip->point_m.col(strip->point_m.cols() - 1);
    return std::atan2(tip.y(), tip.x()) - kPlane;
  };
  std::uintmax_t most = 60;
  double low = 0.5 * c, high = 3 * c;
  if (beyond(low) > 0) return std::nullopt;
  const auto found =
      boost::math::tools::toms748_solve(beyond, low, high, boost::math::tools::eps_tolerance<double>(40), most);
  const double overhang = 0.5 * (found.first + found.second);
  folds = false;
  if (std::abs(beyond(overhang)) > 1e-3 || folds) return std::nullopt;
  return overhang / 2;
}

double bend_stiffening(const BendingLaw& law, double weight) {
  const double curvature = 1 / bending_length(law, weight);
  return std::max(-0.5, law.second_order / law.bend * curvature) / (curvature * curvature);
}

}  // namespace selvedge::material_tests
