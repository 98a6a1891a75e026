#include "rig/arm/path.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "files/bad_input.h"

namespace selvedge::arm {

namespace {

double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10 + x * (-15 + 6 * x));
}

double ramp(double time_s, double duration_s, double ramp_s) {
  return smooth_step(time_s / ramp_s) * smooth_step((duration_s - time_s) / ramp_s);
}

}  // namespace

ToolPath make_sinusoid(const Eigen::Vector3d& start_m, const Sinusoid& sinusoid, double rate_hz) {
  if (!(sinusoid.ramp_s > 0 && 2 * sinusoid.ramp_s <= sinusoid.duration_s))
    refuse("path", "two ramps of {} s do not fit into {} s", sinusoid.ramp_s, sinusoid.duration_s);
  const Eigen::Vector3d direction = sinusoid.direction.normalized();
  const int intervals = static_cast<int>(std::ceil(sinusoid.duration_s * rate_hz));
  ToolPath path;
  path.point_m.resize(3, intervals + 1);
  for (int i = 0; i <= intervals; ++i) {
    const double t = sinusoid.duration_s * i / intervals;
    path.time_s.push_back(t);
    const double swing_m = sinusoid.amplitude_m * std::sin(2 * std::numbers::pi * sinusoid.frequency_hz * t);
    path.point_m.col(i) = start_m + ramp(t, sinusoid.duration_s, sinusoid.ramp_s) * swing_m * direction;
  }
  return path;
}

// Slopes of the clamped cubic spline: h_{i+1} s_{i−1} + 2(h_i + h_{i+1}) s_i + h_i s_{i+1} =
// 3 (h_{i+1} Δ_i + h_i Δ_{i+1}), with Δ the chord slopes, solved by elimination (Thomas).
PathSpline::PathSpline(const ToolPath& path) : path_(path) {
  const long n = path.point_m.cols();
  if (n < 2 || static_cast<long>(path.time_s.size()) != n)
    refuse("path", "at least two points, each with a time, expected");
  if (path.time_s[0] != 0) refuse("path", "the first time is {}, expected 0", path.time_s[0]);
  if (!path.point_m.allFinite()) refuse("path", "a coordinate is not finite");
  for (size_t i = 1; i < path.time_s.size(); ++i)
    if (!(path.time_s[i] > path.time_s[i - 1]) || !std::isfinite(path.time_s[i]))
      refuse("path", "time {} follows {}, strictly rising times expected", path.time_s[i], path.time_s[i - 1]);
  slope_m_s_ = Eigen::Matrix3Xd::Zero(3, n);
  std::vector<double> upper(static_cast<size_t>(n), 0.0);
  for (long i = 1; i + 1 < n; ++i) {
    const auto k = static_cast<size_t>(i);
    const double before = path.time_s[k] - path.time_s[k - 1], after = path.time_s[k + 1] - path.time_s[k];
    const Eigen::Vector3d right = 3 * (after / before * (path.point_m.col(i) - path.point_m.col(i - 1)) +
                                       before / after * (path.point_m.col(i + 1) - path.point_m.col(i)));
    const double pivot = 2 * (before + after) - after * upper[k - 1];
    upper[k] = before / pivot;
    slope_m_s_.col(i) = (right - after * slope_m_s_.col(i - 1)) / pivot;
  }
  for (long i = n - 2; i >= 1; --i) slope_m_s_.col(i) -= upper[static_cast<size_t>(i)] * slope_m_s_.col(i + 1);
}

Eigen::Vector3d PathSpline::at(double time_s) const {
  if (time_s <= 0) return path_.point_m.col(0);
  if (time_s >= duration_s()) return path_.point_m.rightCols<1>();
  const auto right = std::upper_bound(path_.time_s.begin(), path_.time_s.end(), time_s) - path_.time_s.begin();
  const auto left = right - 1;
  const double h = path_.time_s[static_cast<size_t>(right)] - path_.time_s[static_cast<size_t>(left)];
  const double x = (time_s - path_.time_s[static_cast<size_t>(left)]) / h;
  return (1 + 2 * x) * (1 - x) * (1 - x) * path_.point_m.col(left) + x * (1 - x) * (1 - x) * h * slope_m_s_.col(left) +
         x * x * (3 - 2 * x) * path_.point_m.col(right) + x * x * (x - 1) * h * slope_m_s_.col(right);
}

}  // namespace selvedge::arm
