#include "calib/spline_noise.h"

#include <cmath>
#include <vector>

#include "geometry/cubic.h"

namespace selvedge::calib {

using geometry::CubicSpline;

namespace {

constexpr int kImpulseReach = 12;  // samples further off add nothing

// The answer to a single sample of one among zeros, samples a unit of time apart.
const CubicSpline& impulse_answer() {
  static const CubicSpline answer = [] {
    std::vector<double> times;
    std::vector<Eigen::Vector3d> impulse(2 * kImpulseReach + 1, Eigen::Vector3d::Zero());
    for (int i = -kImpulseReach; i <= kImpulseReach; ++i) times.push_back(i);
    impulse[kImpulseReach].x() = 1;
    return CubicSpline(times, impulse);
  }();
  return answer;
}

}  // namespace

double variance_slope(double fraction) {
  double slope = 0;
  for (int sample = -kImpulseReach + 1; sample < kImpulseReach - 1; ++sample)
    slope += 2 * impulse_answer().position(fraction + sample).x() * impulse_answer().velocity(fraction + sample).x();
  return slope;
}

double velocity_variance(double fraction) {
  double variance = 0;
  for (int sample = -kImpulseReach + 1; sample < kImpulseReach - 1; ++sample)
    variance += std::pow(impulse_answer().velocity(fraction + sample).x(), 2);
  return variance;
}

}  // namespace selvedge::calib
