// From a path of the tool point to joint angles, refused before anything moves where it would break a limit.
//
// The tool keeps its orientation. Joint speeds and accelerations are first and second differences over step_s.
// Checked at every step, in this order: workspace, reach, distance of the corners, tool speed, joint angle,
// joint speed, joint acceleration; the error names the first time at which one breaks, and which.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "rig/arm/model.h"
#include "rig/arm/path.h"

namespace selvedge::arm {

// The other corner of the fabric, and how far from it the held one may go.
struct CornerDistance {
  Eigen::Vector3d fixed_corner_m = Eigen::Vector3d::Zero();    // arm base frame
  Eigen::Vector3d corner_from_tool_m = Eigen::Vector3d::Zero();  // held corner less tool point, now
  double limit_m = 0;
};

struct PlanLimits {
  Eigen::Vector3d workspace_low_m = Eigen::Vector3d::Constant(-2);  // box of tool points, arm base frame
  Eigen::Vector3d workspace_high_m = Eigen::Vector3d::Constant(2);
  double tool_speed_m_s = 1.5;
  double start_distance_m = 0.005;   // how far the path's first point may lie from the tool
  double longest_s = 600;
  std::optional<CornerDistance> corners;
};

struct JointPath {
  static constexpr double step_s = 0.004;
  std::vector<Eigen::VectorXd> q_rad;  // one every step_s
  double duration_s() const { return step_s * static_cast<double>(q_rad.size() - 1); }
  // Linear between steps, constant beyond the ends.
  Eigen::VectorXd at(double time_s) const;
};

// start_rad: the joint angles last commanded; the path begins exactly there (a difference of up to
// start_distance_m is taken out over the first half second). Throws BadInput as said above.
JointPath plan(const ArmModel& model, const Eigen::VectorXd& start_rad, const ToolPath& path, const PlanLimits& limits);

}  // namespace selvedge::arm
