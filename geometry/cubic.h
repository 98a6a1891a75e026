// Cubics between samples in time.
//
// hermite: from values and slopes at both ends of an interval. catmull_rom: through the middle two of four samples at
// regular times, with slopes from their neighbours. CubicSpline: through all samples; between them the second
// derivative is linear, at both ends it is zero, and it follows from a tridiagonal system. s, m. Source: C. de Boor,
// A Practical Guide to Splines, chapter IV.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace selvedge::geometry {

// share: place in the interval, 0 to 1; length_s: its length. T: a vector or matrix of Eigen, or a number.
template <class T>
T hermite(double share, double length_s, const T& from, const T& from_rate, const T& to, const T& to_rate) {
  const double x = share, x2 = x * x, x3 = x2 * x;
  return T((2 * x3 - 3 * x2 + 1) * from + (x3 - 2 * x2 + x) * length_s * from_rate + (3 * x2 - 2 * x3) * to +
           (x3 - x2) * length_s * to_rate);
}

// share: place between p1 and p2.
template <class T>
T catmull_rom(double share, const T& p0, const T& p1, const T& p2, const T& p3) {
  const double x = share, x2 = x * x, x3 = x2 * x;
  return T(0.5 * ((-x + 2 * x2 - x3) * p0 + (2 - 5 * x2 + 3 * x3) * p1 + (x + 4 * x2 - 3 * x3) * p2 + (x3 - x2) * p3));
}

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

}  // namespace selvedge::geometry
