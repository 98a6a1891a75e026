// A natural cubic spline through samples of a point in time.
//
// Between samples the second derivative is linear; at both ends it is zero. The second derivatives follow
// from a tridiagonal system. s, m. Source: C. de Boor, A Practical Guide to Splines, chapter IV.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace selvedge::calib {

class CubicSpline {
 public:
  // time_s strictly ascending, at least three samples. Throws std::invalid_argument otherwise.
  CubicSpline(std::vector<double> time_s, std::vector<Eigen::Vector3d> position);

  // Within the samples' times.
  Eigen::Vector3d position(double time_s) const;
  Eigen::Vector3d velocity(double time_s) const;

  // Length of the interval between samples that holds a time; infinite outside.
  double gap_s(double time_s) const;

  // Place of a time within its interval, 0 to 1.
  double fraction(double time_s) const;

 private:
  size_t interval(double time_s) const;

  std::vector<double> time_;
  std::vector<Eigen::Vector3d> position_, second_derivative_;
};

// Derivative by the place in the interval of the variance that unit noise of even samples leaves between them:
// 1 at a sample, less half way.
double variance_slope(double fraction);

// Variance that the same noise gives the velocity there, per interval squared.
double velocity_variance(double fraction);

}  // namespace selvedge::calib
