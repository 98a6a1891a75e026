// Paths of the tool point in time, m and s, that begin and end at rest.
//
// Ramp: w(t) rises from 0 to 1 within ramp_s as 10x³ − 15x⁴ + 6x⁵ (no jump in speed or acceleration) and falls
// likewise before the end. Sinusoid: start + w(t)·amplitude·sin(2πft)·direction.
// Between points a path is a cubic spline with zero speed at both ends.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace selvedge::arm {

struct ToolPath {
  std::vector<double> time_s;  // first 0, strictly rising
  Eigen::Matrix3Xd point_m;    // one column a time, arm base frame
};

struct Sinusoid {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
  double amplitude_m = 0.06;
  double frequency_hz = 1.2;
  double duration_s = 10;  // with both ramps
  double ramp_s = 1.5;     // of each
};

// rate_hz: of the points. Throws BadInput where the ramps do not fit into the duration.
ToolPath make_sinusoid(const Eigen::Vector3d& start_m, const Sinusoid& sinusoid, double rate_hz = 100);

class PathSpline {
 public:
  // Throws BadInput where the times do not rise strictly from 0, or anything is not finite.
  explicit PathSpline(const ToolPath& path);
  double duration_s() const { return path_.time_s.back(); }
  Eigen::Vector3d at(double time_s) const;  // constant beyond the ends

 private:
  ToolPath path_;
  Eigen::Matrix3Xd slope_m_s_;
};

}  // namespace selvedge::arm
