#include <numbers>

#include "files/bad_input.h"
#include "rig/arm/daemon.h"

namespace selvedge::arm {

namespace {

Eigen::Vector3d vector(rig::Section& keys, const std::string& key, const Eigen::Vector3d& fallback, double most,
                       const std::string& unit) {
  const auto values = keys.numbers(key, std::vector<double>{fallback.x(), fallback.y(), fallback.z()}, 3, -most, most, unit);
  return {values[0], values[1], values[2]};
}

Eigen::Isometry3d read_base(rig::Section& keys) {
  const Eigen::Vector3d position_m = vector(keys, "base_position_m", Eigen::Vector3d::Zero(), 100, "m");
  const Eigen::Vector3d rpy = vector(keys, "base_rpy_deg", Eigen::Vector3d::Zero(), 360, "degrees") * std::numbers::pi / 180;
  Eigen::Isometry3d world_from_base = Eigen::Isometry3d::Identity();
  world_from_base.linear() = (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
                              Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
                                 .toRotationMatrix();
  world_from_base.translation() = position_m;
  return world_from_base;
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
  controller.controller_timeout_s = keys.number("controller_timeout_s", controller.controller_timeout_s, 0.02, 0.1, "s");
  controller.connect_timeout_s = keys.number("connect_timeout_s", controller.connect_timeout_s, 0.1, 60, "s");
  result.world_from_base = read_base(keys);
  GuardLimits& guard = result.guard;
  guard.following_error_rad = keys.number("following_error_rad", guard.following_error_rad, 0.001, 1, "rad");
  guard.stop_ramp_s = keys.number("stop_ramp_s", guard.stop_ramp_s, 0.02, 1, "s");
  result.plan.workspace_low_m = vector(keys, "workspace_low_m", result.plan.workspace_low_m, 10, "m");
  result.plan.workspace_high_m = vector(keys, "workspace_high_m", result.plan.workspace_high_m, 10, "m");
  if ((result.plan.workspace_low_m.array() >= result.plan.workspace_high_m.array()).any())
    refuse(keys.where() + " workspace_low_m", "each number must lie below that of workspace_high_m");
  result.plan.tool_speed_m_s = keys.number("tool_speed_m_s", result.plan.tool_speed_m_s, 0.01, 10, "m/s");
  result.corner_distance_m = keys.number("corner_distance_m", result.corner_distance_m, 0, 10, "m");
  result.tracker = keys.text("tracker", result.tracker);
  result.held_corner = keys.text("held_corner", result.held_corner);
  result.fixed_corner = keys.text("fixed_corner", result.fixed_corner);
  result.tracker_timeout_s = keys.number("tracker_timeout_s", result.tracker_timeout_s, 0.02, 10, "s");
  if (result.corner_distance_m > 0 && result.tracker.empty())
    refuse(keys.where() + " corner_distance_m", "it needs a tracker to see the corners");
  keys.finish();
  return result;
}

}  // namespace selvedge::arm
