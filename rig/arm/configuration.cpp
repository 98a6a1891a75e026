#include <numbers>

#include "files/bad_input.h"
#include "rig/arm/daemon.h"

namespace selvedge::arm {

namespace {

Eigen::Vector3d vector(rig::Section& keys, const std::string& key, const Eigen::Vector3d& fallback, double most,
                       const std::string& unit) {
  const auto values =
      keys.numbers(key, std::vector<double>{fallback.x(), fallback.y(), fallback.z()}, 3, -most, most, unit);
  return {values[0], values[1], values[2]};
}

Eigen::Isometry3d read_base(rig::Section& keys) {
  const Eigen::Vector3d position_m = vector(keys, "base_position_m", Eigen::Vector3d::Zero(), 100, "m");
  const Eigen::Vector3d rpy =
      vector(keys, "base_rpy_deg", Eigen::Vector3d::Zero(), 360, "degrees") * std::numbers::pi / 180;
  Eigen::Isometry3d world_from_base = Eigen::Isometry3d::Identity();
  world_from_base.linear() =
      (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  world_from_base.translation() = position_m;
  return world_from_base;
}

// Both corners of a box, each number of `low` below that of `high`.
void read_box(rig::Section& keys, const std::string& low, Eigen::Vector3d& low_m, const std::string& high,
              Eigen::Vector3d& high_m) {
  low_m = vector(keys, low, low_m, 10, "m");
  high_m = vector(keys, high, high_m, 10, "m");
  if ((low_m.array() >= high_m.array()).any())
    refuse(keys.where() + " " + low, "each number must lie below that of {}", high);
}

void read_plan_limits(rig::Section& keys, ArmConfiguration& result) {
  PlanLimits& plan = result.plan;
  plan.world_from_base = result.world_from_base;
  read_box(keys, "workspace_low_m", plan.workspace_low_m, "workspace_high_m", plan.workspace_high_m);
  read_box(keys, "links_low_m", plan.links_low_m, "links_high_m", plan.links_high_m);
  plan.link_radius_m = keys.number("link_radius_m", plan.link_radius_m, 0, 0.5, "m");
  plan.tool_speed_m_s = keys.number("tool_speed_m_s", plan.tool_speed_m_s, 0.01, 10, "m/s");
  rig::Section obstacles = keys.section("obstacle");
  for (const std::string& name : obstacles.keys()) {
    rig::Section box = obstacles.section(name);
    for (const char* edge : {"low_m", "high_m"})
      if (!box.has(edge))
        refuse(box.where() + " " + edge, "missing, three numbers in m expected (motion-capture frame)");
    Obstacle obstacle{name, {}, {}};
    obstacle.low_m.setZero();
    obstacle.high_m.setZero();
    read_box(box, "low_m", obstacle.low_m, "high_m", obstacle.high_m);
    box.finish();
    plan.obstacles.push_back(obstacle);
  }
  obstacles.finish();
}

}  // namespace

ArmConfiguration read_configuration(rig::Section keys) {
  ArmConfiguration result;
  result.backend = keys.choice("backend", result.backend, {"rtde", "mxt"});
  result.model = keys.text("model", std::nullopt);
  ArmOptions& controller = result.controller;
  controller.host = keys.text("host", controller.host);
  controller.port = static_cast<int>(keys.integer("port", 0, 0, 65535));
  controller.script_port = static_cast<int>(keys.integer("script_port", controller.script_port, 1, 65535));
  controller.script_address = keys.text("script_address", controller.script_address);
  controller.rate_hz = keys.number("rate_hz", controller.rate_hz, 50, 500, "Hz");
  controller.controller_timeout_s =
      keys.number("controller_timeout_s", controller.controller_timeout_s, 0.02, 0.1, "s");
  controller.connect_timeout_s = keys.number("connect_timeout_s", controller.connect_timeout_s, 0.1, 60, "s");
  result.world_from_base = read_base(keys);
  GuardLimits& guard = result.guard;
  guard.following_error_rad = keys.number("following_error_rad", guard.following_error_rad, 0.001, 1, "rad");
  guard.stop_ramp_s = keys.number("stop_ramp_s", guard.stop_ramp_s, 0.02, 1, "s");
  read_plan_limits(keys, result);
  result.tracker = keys.text("tracker", result.tracker);
  TrackerLimits& corners = result.corners;
  corners.corner_distance_m = keys.number("corner_distance_m", corners.corner_distance_m, 0, 10, "m");
  corners.held_corner = keys.text("held_corner", corners.held_corner);
  corners.fixed_corner = keys.text("fixed_corner", corners.fixed_corner);
  corners.timeout_s = keys.number("tracker_timeout_s", corners.timeout_s, 0.02, 10, "s");
  if (corners.corner_distance_m > 0 && result.tracker.empty())
    refuse(keys.where() + " corner_distance_m", "it needs a tracker to see the corners");
  result.control_socket = keys.text("control_socket", "");
  result.stop_file = keys.text("stop_file", "");
  result.control_users = keys.texts("control_users", std::vector<std::string>{});
  keys.finish();
  return result;
}

}  // namespace selvedge::arm
