#include "material_tests/stretch_law.h"

#include <algorithm>
#include <cmath>

#include "cloth/stiffening.h"

namespace selvedge::material_tests {

using Eigen::ArrayXd;
using Eigen::Index;

namespace {

// Both rise: the value of `to` where `from` takes x, ends beyond the ends.
double interpolated(const ArrayXd& from, const ArrayXd& to, double x) {
  const double* begin = from.data();
  const Index i = std::clamp<Index>(std::upper_bound(begin, begin + from.size(), x) - begin, 1, from.size() - 1);
  const double share = std::clamp((x - from(i - 1)) / (from(i) - from(i - 1)), 0.0, 1.0);
  return to(i - 1) + share * (to(i) - to(i - 1));
}

// Without the coupling.
double stress(const StretchLaw& law, int direction, double strain) {
  const auto d = static_cast<size_t>(direction);
  const double bent = law.large ? std::max(0.05, 1 + law.stiffening[d] * std::abs(strain))
                                : cloth::stretch_factor(law.stiffening[d], strain);
  const double locked = std::exp(std::min(30.0, std::pow(strain / law.locking[d], 4)));
  return law.stiffness[d] * strain * bent * locked;
}

// A table that rises throughout from 0, so that it can be read the other way: a stress that falls is passed over.
void make_rising(ArrayXd& values) {
  constexpr double kLeast = 1e-9;  // relative
  for (Index i = 1; i < values.size(); ++i)
    values(i) = std::max(values(i), values(i - 1) * (1 + kLeast) + kLeast * std::abs(values(1)) + 1e-300);
}

}  // namespace

Pulled pulled(const StretchLaw& law, int direction, const ArrayXd& force_per_width) {
  constexpr Index kAlong = 1200, kAcross = 300;
  constexpr double kLongest = 5, kNarrowest = 0.15;
  const auto strain = [&](double stretch) { return law.large ? 0.5 * (stretch * stretch - 1) : stretch - 1; };
  const double couples = law.coupling * std::sqrt(law.stiffness[0] * law.stiffness[1]);
  // Finer where stretch is small: that is where most fabrics are.
  const ArrayXd along = 1 + (kLongest - 1) * ArrayXd::LinSpaced(kAlong, 0, 1).square();
  const ArrayXd narrowing = ArrayXd::LinSpaced(kAcross, 0, -strain(kNarrowest));
  ArrayXd resists = narrowing.unaryExpr([&](double e) { return stress(law, 1 - direction, e); });
  make_rising(resists);
  ArrayXd force(kAlong), across(kAlong);
  for (Index i = 0; i < kAlong; ++i) {
    const double e = strain(along(i)),
                 side = std::copysign(interpolated(resists, narrowing, std::abs(couples * e)), -couples * e);
    across(i) = law.large ? std::sqrt(std::max(0.0, 1 + 2 * side)) : 1 + side;
    force(i) = (stress(law, direction, e) + couples * side) * (law.large ? along(i) : 1);
  }
  make_rising(force);
  Pulled out{ArrayXd(force_per_width.size()), ArrayXd(force_per_width.size())};
  for (Index i = 0; i < force_per_width.size(); ++i) {
    out.along(i) = interpolated(force, along, force_per_width(i));
    out.across(i) =
        1 + law.narrowing_seen[static_cast<size_t>(direction)] * (interpolated(along, across, out.along(i)) - 1);
  }
  return out;
}

}  // namespace selvedge::material_tests
