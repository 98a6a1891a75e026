#include "rig/arm/plan.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "files/bad_input.h"

namespace selvedge::arm {

namespace {

constexpr double kBlend_s = 0.5;
constexpr double kStep_s = JointPath::step_s;
constexpr double kSample_m = 0.01;       // of a link, against a box
constexpr double kStandsStill_m = 1e-9;  // a link's end that no joint moves

void require_finite(const Eigen::VectorXd& numbers, const char* what, double t) {
  if (!numbers.allFinite()) refuse("arm path", "at {:.3f} s the {} is not finite", t, what);
}

// Says the limit by its name; what is not a number lies outside.
void check_box(const Eigen::Vector3d& point_m, const Eigen::Vector3d& low_m, const Eigen::Vector3d& high_m, double t,
               const std::string& what) {
  for (int axis = 0; axis < 3; ++axis)
    if (!(point_m[axis] >= low_m[axis] && point_m[axis] <= high_m[axis]))
      refuse("arm path", "at {:.3f} s {} leaves the workspace: {} = {:.4f} m, limits {} to {} m", t, what, "xyz"[axis],
             point_m[axis], low_m[axis], high_m[axis]);
}

void check_corners(const Eigen::Vector3d& point_m, double t, const PlanLimits& limits) {
  if (!limits.corners) return;
  const double distance_m = (point_m + limits.corners->corner_from_tool_m - limits.corners->fixed_corner_m).norm();
  if (!(distance_m <= limits.corners->limit_m))
    refuse("arm path", "at {:.3f} s the corners are {:.4f} m apart, the fabric allows {:.4f} m", t, distance_m,
           limits.corners->limit_m);
}

void check_joints(const Eigen::MatrixXd& q, long i, const ArmModel& model) {
  const double t = kStep_s * static_cast<double>(i);
  for (int joint = 0; joint < model.joints(); ++joint) {
    const JointLimits& limit = model.limits()[static_cast<size_t>(joint)];
    const double angle = q(joint, i);
    if (!(angle >= limit.lower_rad && angle <= limit.upper_rad))
      refuse("arm path", "at {:.3f} s joint {} stands at {:.3f} rad, limits {:.3f} to {:.3f} rad", t, joint + 1, angle,
             limit.lower_rad, limit.upper_rad);
    const double speed = i >= 1 ? std::abs(q(joint, i) - q(joint, i - 1)) / kStep_s : 0;
    if (!(speed <= limit.speed_rad_s))
      refuse("arm path", "at {:.3f} s joint {} turns at {:.3f} rad/s, limit {:.3f} rad/s", t, joint + 1, speed,
             limit.speed_rad_s);
    const double acceleration =
        i >= 2 ? std::abs(q(joint, i) - 2 * q(joint, i - 1) + q(joint, i - 2)) / (kStep_s * kStep_s) : 0;
    if (!(acceleration <= limit.acceleration_rad_s2))
      refuse("arm path", "at {:.3f} s joint {} accelerates at {:.2f} rad/s², limit {:.2f} rad/s²", t, joint + 1,
             acceleration, limit.acceleration_rad_s2);
  }
}

// The arm's body along the path: its links against the workspace and whatever stands about.
class Links {
 public:
  Links(const ArmModel& model, const PlanLimits& limits) : model_(model), limits_(limits) {
    // Which places any joint moves, told from two poses that differ in every joint.
    const Eigen::VectorXd home = model.home_rad();
    const auto here = model.link_points(home),
               there = model.link_points(home + Eigen::VectorXd::Constant(home.size(), 0.37));
    for (size_t i = 0; i < here.size(); ++i) moves_.push_back((here[i] - there[i]).norm() > kStandsStill_m);
  }

  void check(const Eigen::VectorXd& q_rad, double t) const {
    const std::vector<Eigen::Vector3d> points = model_.link_points(q_rad);
    for (size_t i = 1; i < points.size(); ++i) {
      if (!moves_[i]) continue;
      check_box(points[i], limits_.links_low_m, limits_.links_high_m, t,
                i + 1 == points.size() ? "the tool" : "link " + std::to_string(i));
      const Eigen::Vector3d from_m = limits_.world_from_base * points[i - 1],
                            to_m = limits_.world_from_base * points[i];
      for (const Obstacle& obstacle : limits_.obstacles) {
        const double distance_m = distance_to_box(from_m, to_m, obstacle);
        if (!(distance_m >= limits_.link_radius_m))
          refuse("arm path", "at {:.3f} s link {} comes within {:.3f} m of {}, at least {} m expected", t, i,
                 distance_m, obstacle.name, limits_.link_radius_m);
      }
    }
  }

 private:
  const ArmModel& model_;
  const PlanLimits& limits_;
  std::vector<bool> moves_;
};

void require_finite_limits(const Eigen::VectorXd& start_rad, const PlanLimits& limits) {
  require_finite(start_rad, "joint angle that it starts from", 0);
  require_finite(limits.world_from_base.matrix().reshaped(), "pose of the arm's base", 0);
  if (!limits.corners) return;
  require_finite(limits.corners->fixed_corner_m, "place of the fixed corner", 0);
  require_finite(limits.corners->corner_from_tool_m, "place of the held corner", 0);
}

}  // namespace

double distance_to_box(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Obstacle& box) {
  const int pieces = std::max(1, static_cast<int>(std::ceil((b - a).norm() / kSample_m)));
  double nearest_m = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= pieces; ++i) {
    const Eigen::Vector3d point_m = a + (b - a) * (static_cast<double>(i) / pieces);
    const Eigen::Vector3d outside_m = (box.low_m - point_m).cwiseMax(point_m - box.high_m).cwiseMax(0);
    nearest_m = std::min(nearest_m, outside_m.norm());
  }
  // Between two samples the line may come nearer by half their distance.
  return std::max(0.0, nearest_m - 0.5 * kSample_m);
}

Eigen::VectorXd JointPath::at(double time_s) const {
  const double place = std::clamp(time_s / step_s, 0.0, static_cast<double>(q_rad.cols() - 1));
  const auto left = static_cast<long>(place);
  if (left + 1 >= q_rad.cols()) return q_rad.col(q_rad.cols() - 1);
  const double x = place - static_cast<double>(left);
  return (1 - x) * q_rad.col(left) + x * q_rad.col(left + 1);
}

JointPath plan(const ArmModel& model, const Eigen::VectorXd& start_rad, const ToolPath& path, const PlanLimits& limits,
               const std::stop_token& cancelled) {
  require_finite_limits(start_rad, limits);
  const PathSpline spline(path);
  if (!(spline.duration_s() <= limits.longest_s))
    refuse("arm path", "it lasts {} s, at most {} s", spline.duration_s(), limits.longest_s);
  Eigen::Isometry3d pose = model.base_from_tool(start_rad);
  const Eigen::Vector3d start_m = pose.translation(), off_m = start_m - spline.at(0);
  if (!(off_m.norm() <= limits.start_distance_m))
    refuse("arm path", "at 0 s it begins {:.4f} m from the tool, at most {} m", off_m.norm(), limits.start_distance_m);

  const Links links(model, limits);
  const auto steps = static_cast<long>(std::ceil(spline.duration_s() / kStep_s));
  JointPath result;
  result.q_rad.resize(model.joints(), steps + 1);
  Eigen::VectorXd q_rad = start_rad;
  Eigen::Vector3d before_m = start_m;
  for (long i = 0; i <= steps; ++i) {
    if (cancelled.stop_requested()) throw Cancelled{};
    const double t = kStep_s * static_cast<double>(i);
    const double left = std::clamp(1 - t / std::min(kBlend_s, spline.duration_s()), 0.0, 1.0);
    const Eigen::Vector3d point_m = spline.at(t) + left * left * left * (10 - left * (15 - 6 * left)) * off_m;
    require_finite(point_m, "tool point", t);
    check_box(point_m, limits.workspace_low_m, limits.workspace_high_m, t, "the tool");
    pose.translation() = point_m;
    const auto solved = model.inverse(pose, q_rad);
    if (!solved)
      refuse("arm path", "at {:.3f} s the tool point ({:.4f}, {:.4f}, {:.4f}) m is out of reach", t, point_m.x(),
             point_m.y(), point_m.z());
    check_corners(point_m, t, limits);
    const double speed_m_s = (point_m - before_m).norm() / kStep_s;
    if (!(speed_m_s <= limits.tool_speed_m_s))
      refuse("arm path", "at {:.3f} s the tool moves at {:.3f} m/s, limit {} m/s", t, speed_m_s, limits.tool_speed_m_s);
    before_m = point_m;
    q_rad = *solved;
    result.q_rad.col(i) = q_rad;
    check_joints(result.q_rad, i, model);
    links.check(q_rad, t);
  }
  return result;
}

}  // namespace selvedge::arm
