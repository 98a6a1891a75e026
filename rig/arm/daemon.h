// The arm's daemon: control from its socket, set-points to the controller, state to the bus.
//
// motion_guard.h decides what moves. Who may command it: control_server.h; a stop is obeyed from anybody, at once, and
// holds until it is reset (stop_latch.h). A trajectory is planned and checked on a thread of its own while the arm
// holds; arm_status_t says when it is ready, or which limit it would break first. Planning needs to know how far
// apart the corners are: the tracker's newest sample, brought into the arm's base frame by base_position_m and
// base_rpy_deg. While the arm moves, a tracker that is silent or stands still for tracker_timeout_s, or corners further
// apart than allowed, stop it (tracker_watch.h).
// Each cycle looks at the stop, the lease and every age, whether the controller sent a sample or not. Where the system
// lets it, the loop runs at real-time priority with its memory locked; the log says whether.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "rig/arm/arm.h"
#include "rig/arm/motion_guard.h"
#include "rig/arm/plan.h"
#include "rig/arm/tracker_watch.h"
#include "rig/configuration.h"

namespace selvedge::arm {

struct ArmConfiguration {
  std::string backend = "rtde";                                       // or "mxt"
  std::filesystem::path model;                                        // data/arms/*.toml
  ArmOptions controller;                                              // host, port, rate_hz …
  Eigen::Isometry3d world_from_base = Eigen::Isometry3d::Identity();  // base_position_m, base_rpy_deg
  GuardLimits guard;
  PlanLimits plan;                         // workspace_low_m … links_high_m, link_radius_m, tool_speed_m_s, obstacles
  std::string tracker = "tracker";         // section of the tracker; "" where there is none
  TrackerLimits corners;                   // tracker_timeout_s, corner_distance_m, held_corner, fixed_corner
  std::filesystem::path control_socket;    // "": in the user's runtime folder (control_link.h)
  std::filesystem::path stop_file;         // "": beside control_socket, or in the user's state folder (control_link.h)
  std::vector<std::string> control_users;  // beside the daemon's own and root: who may arm and move
};

// [arm] of the configuration. Throws BadInput.
ArmConfiguration read_configuration(rig::Section keys);

// Runs until `stopping`.
void run_daemon(const rig::Configuration& configuration, const std::atomic<bool>& stopping,
                const std::string& device = "arm");

}  // namespace selvedge::arm
