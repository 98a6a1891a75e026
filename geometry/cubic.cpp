#include "geometry/cubic.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace selvedge::geometry {

CubicSpline::CubicSpline(std::vector<double> time_s, std::vector<Eigen::Vector3d> position)
    : time_(std::move(time_s)), position_(std::move(position)) {
  const size_t n = time_.size();
  if (n < 3 || position_.size() != n) throw std::invalid_argument("CubicSpline: needs three samples or more");
  for (size_t i = 1; i < n; ++i)
    if (!(time_[i] > time_[i - 1])) throw std::invalid_argument("CubicSpline: times must ascend");
  // Thomas's algorithm for the second derivatives.
  second_derivative_.assign(n, Eigen::Vector3d::Zero());
  std::vector<double> ratio(n, 0.0);
  std::vector<Eigen::Vector3d> right(n, Eigen::Vector3d::Zero());
  for (size_t i = 1; i + 1 < n; ++i) {
    const double before = time_[i] - time_[i - 1], after = time_[i + 1] - time_[i];
    const double diagonal = 2 * (before + after) - before * ratio[i - 1];
    ratio[i] = after / diagonal;
    const Eigen::Vector3d bend =
        6 * ((position_[i + 1] - position_[i]) / after - (position_[i] - position_[i - 1]) / before);
    right[i] = (bend - before * right[i - 1]) / diagonal;
  }
  for (size_t i = n - 2; i >= 1; --i) second_derivative_[i] = right[i] - ratio[i] * second_derivative_[i + 1];
}

size_t CubicSpline::interval(double time_s) const {
  const auto after = std::upper_bound(time_.begin(), time_.end(), time_s);
  const auto index =
      std::clamp<std::ptrdiff_t>(after - time_.begin() - 1, 0, static_cast<std::ptrdiff_t>(time_.size()) - 2);
  return static_cast<size_t>(index);
}

Eigen::Vector3d CubicSpline::position(double time_s) const {
  const size_t i = interval(time_s);
  const double h = time_[i + 1] - time_[i], b = (time_s - time_[i]) / h, a = 1 - b;
  return a * position_[i] + b * position_[i + 1] +
         h * h / 6 * ((a * a * a - a) * second_derivative_[i] + (b * b * b - b) * second_derivative_[i + 1]);
}

Eigen::Vector3d CubicSpline::velocity(double time_s) const {
  const size_t i = interval(time_s);
  const double h = time_[i + 1] - time_[i], b = (time_s - time_[i]) / h, a = 1 - b;
  return (position_[i + 1] - position_[i]) / h +
         h / 6 * ((3 * b * b - 1) * second_derivative_[i + 1] - (3 * a * a - 1) * second_derivative_[i]);
}

double CubicSpline::gap_s(double time_s) const {
  if (time_s < time_.front() || time_s > time_.back()) return std::numeric_limits<double>::infinity();
  const size_t i = interval(time_s);
  return time_[i + 1] - time_[i];
}

double CubicSpline::fraction(double time_s) const {
  const size_t i = interval(time_s);
  return (time_s - time_[i]) / (time_[i + 1] - time_[i]);
}

}  // namespace selvedge::geometry
