// From a path of the tool point to joint angles, refused before anything moves where it would break a limit.
//
// The tool keeps its orientation. Joint speeds and accelerations are first and second differences over step_s.
// Checked at every step, in this order: workspace of the tool, reach, distance of the corners, tool speed, joint angle,
// joint speed, joint acceleration, every link against workspace and obstacles; the error names the first time at which
// one breaks, and which. A number that is not finite is refused by its name.
//
// A link is the straight line between two joints, link_radius_m thick all round. Links that no joint moves (the foot)
// are not looked at: they stand where the lab has put them.
#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "rig/arm/model.h"
#include "rig/arm/path.h"

namespace selvedge::arm {

// The other corner of the fabric, and how far from it the held one may go.
struct CornerDistance {
  Eigen::Vector3d fixed_corner_m = Eigen::Vector3d::Zero();      // arm base frame
  Eigen::Vector3d corner_from_tool_m = Eigen::Vector3d::Zero();  // held corner less tool point, now
  double limit_m = 0;
};

// What stands in the arm's way: a table, the fabric's stand. Edges along the axes of the motion-capture frame.
struct Obstacle {
  std::string name;
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero(), high_m = Eigen::Vector3d::Zero();
};

struct PlanLimits {
  Eigen::Vector3d workspace_low_m = Eigen::Vector3d::Constant(-2);  // box of tool points, arm base frame
  Eigen::Vector3d workspace_high_m = Eigen::Vector3d::Constant(2);
  Eigen::Vector3d links_low_m = Eigen::Vector3d::Constant(-2);  // box of the joints and the tool, arm base frame
  Eigen::Vector3d links_high_m = Eigen::Vector3d::Constant(2);
  double link_radius_m = 0.06;
  std::vector<Obstacle> obstacles;
  Eigen::Isometry3d world_from_base = Eigen::Isometry3d::Identity();  // for the obstacles
  double tool_speed_m_s = 1.5;
  double start_distance_m = 0.005;  // how far the path's first point may lie from the tool
  double longest_s = 600;
  std::optional<CornerDistance> corners;
};

struct JointPath {
  static constexpr double step_s = 0.004;
  Eigen::MatrixXd q_rad;  // joints × steps, one column every step_s
  double duration_s() const { return step_s * static_cast<double>(q_rad.cols() - 1); }
  // Linear between steps, constant beyond the ends.
  Eigen::VectorXd at(double time_s) const;
};

// start_rad: the joint angles last commanded; the path begins exactly there (a difference of up to
// start_distance_m is taken out over the first half second). Throws BadInput as said above, and Cancelled once
// `cancelled` is asked to stop.
struct Cancelled {};
JointPath plan(const ArmModel& model, const Eigen::VectorXd& start_rad, const ToolPath& path, const PlanLimits& limits,
               const std::stop_token& cancelled = {});

// Distance of the segment from `a` to `b` to the box, 0 where they meet; short of the true one by at most 5 mm. m
double distance_to_box(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Obstacle& box);

}  // namespace selvedge::arm
