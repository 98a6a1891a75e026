// What a cubic spline through noisy even samples (geometry/cubic.h) makes of their noise.
#pragma once

namespace selvedge::calib {

// Derivative by the place in the interval of the variance that unit noise of even samples leaves between them:
// 1 at a sample, less half way.
double variance_slope(double fraction);

// Variance that the same noise gives the velocity there, per interval squared.
double velocity_variance(double fraction);

}  // namespace selvedge::calib
