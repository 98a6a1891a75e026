#include "rig/arm/plan.h"

#include <algorithm>
#include <cmath>

#include "files/bad_input.h"

namespace selvedge::arm {

namespace {

constexpr double kBlend_s = 0.5;
constexpr double kStep_s = JointPath::step_s;

void check_point(const Eigen::Vector3d& point_m, double t, const PlanLimits& limits) {
  for (int axis = 0; axis < 3; ++axis)
    if (point_m[axis] < limits.workspace_low_m[axis] || point_m[axis] > limits.workspace_high_m[axis])
      refuse("arm path", "at {:.3f} s the tool leaves the workspace: {} = {:.4f} m, limits {} to {} m", t, "xyz"[axis],
             point_m[axis], limits.workspace_low_m[axis], limits.workspace_high_m[axis]);
}

void check_corners(const Eigen::Vector3d& point_m, double t, const PlanLimits& limits) {
  if (!limits.corners) return;
  const double distance_m = (point_m + limits.corners->corner_from_tool_m - limits.corners->fixed_corner_m).norm();
  if (distance_m > limits.corners->limit_m)
    refuse("arm path", "at {:.3f} s the corners are {:.4f} m apart, the fabric allows {:.4f} m", t, distance_m,
           limits.corners->limit_m);
}

void check_joints(const std::vector<Eigen::VectorXd>& q, const ArmModel& model) {
  const size_t i = q.size() - 1;
  const double t = kStep_s * static_cast<double>(i);
  for (int joint = 0; joint < model.joints(); ++joint) {
    const JointLimits& limit = model.limits()[static_cast<size_t>(joint)];
    const double angle = q[i][joint];
    if (angle < limit.lower_rad || angle > limit.upper_rad)
      refuse("arm path", "at {:.3f} s joint {} stands at {:.3f} rad, limits {:.3f} to {:.3f} rad", t, joint + 1, angle,
             limit.lower_rad, limit.upper_rad);
    const double speed = i >= 1 ? std::abs(q[i][joint] - q[i - 1][joint]) / kStep_s : 0;
    if (speed > limit.speed_rad_s)
      refuse("arm path", "at {:.3f} s joint {} turns at {:.3f} rad/s, limit {:.3f} rad/s", t, joint + 1, speed, limit.speed_rad_s);
    const double acceleration =
        i >= 2 ? std::abs(q[i][joint] - 2 * q[i - 1][joint] + q[i - 2][joint]) / (kStep_s * kStep_s) : 0;
    if (acceleration > limit.acceleration_rad_s2)
      refuse("arm path", "at {:.3f} s joint {} accelerates at {:.2f} rad/s², limit {:.2f} rad/s²", t, joint + 1, acceleration,
             limit.acceleration_rad_s2);
  }
}

}  // namespace

Eigen::VectorXd JointPath::at(double time_s) const {
  const double place = std::clamp(time_s / step_s, 0.0, static_cast<double>(q_rad.size() - 1));
  const auto left = static_cast<size_t>(place);
  if (left + 1 >= q_rad.size()) return q_rad.back();
  const double x = place - static_cast<double>(left);
  return (1 - x) * q_rad[left] + x * q_rad[left + 1];
}

JointPath plan(const ArmModel& model, const Eigen::VectorXd& start_rad, const ToolPath& path, const PlanLimits& limits) {
  const PathSpline spline(path);
  if (spline.duration_s() > limits.longest_s)
    refuse("arm path", "it lasts {} s, at most {} s", spline.duration_s(), limits.longest_s);
  Eigen::Isometry3d pose = model.base_from_tool(start_rad);
  const Eigen::Vector3d start_m = pose.translation(), off_m = start_m - spline.at(0);
  if (off_m.norm() > limits.start_distance_m)
    refuse("arm path", "at 0 s it begins {:.4f} m from the tool, at most {} m", off_m.norm(), limits.start_distance_m);

  JointPath result;
  Eigen::VectorXd q_rad = start_rad;
  Eigen::Vector3d before_m = start_m;
  const auto steps = static_cast<long>(std::ceil(spline.duration_s() / kStep_s));
  for (long i = 0; i <= steps; ++i) {
    const double t = kStep_s * static_cast<double>(i);
    const double left = std::clamp(1 - t / std::min(kBlend_s, spline.duration_s()), 0.0, 1.0);
    const Eigen::Vector3d point_m = spline.at(t) + left * left * left * (10 - left * (15 - 6 * left)) * off_m;
    check_point(point_m, t, limits);
    pose.translation() = point_m;
    const auto solved = model.inverse(pose, q_rad);
    if (!solved) refuse("arm path", "at {:.3f} s the tool point ({:.4f}, {:.4f}, {:.4f}) m is out of reach", t, point_m.x(), point_m.y(), point_m.z());
    check_corners(point_m, t, limits);
    const double speed_m_s = (point_m - before_m).norm() / kStep_s;
    if (speed_m_s > limits.tool_speed_m_s)
      refuse("arm path", "at {:.3f} s the tool moves at {:.3f} m/s, limit {} m/s", t, speed_m_s, limits.tool_speed_m_s);
    before_m = point_m;
    q_rad = *solved;
    result.q_rad.push_back(q_rad);
    check_joints(result.q_rad, model);
  }
  return result;
}

}  // namespace selvedge::arm
