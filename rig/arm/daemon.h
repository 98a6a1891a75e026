// The arm's daemon: control messages and trajectories from the bus, set-points to the controller, state back.
//
// motion_guard.h decides what moves. A trajectory is planned and checked on a thread of its own while the arm
// holds; arm_status_t says when it is ready, or which limit it would break first. Planning needs to know how far
// apart the corners are: the tracker's newest sample, brought into the arm's base frame by base_position_m and
// base_rpy_deg. While the arm moves, a tracker that is silent for tracker_timeout_s, or corners further apart
// than allowed, stop it.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include <Eigen/Geometry>

#include "rig/arm/arm.h"
#include "rig/arm/motion_guard.h"
#include "rig/arm/plan.h"
#include "rig/configuration.h"

namespace selvedge::arm {

struct ArmConfiguration {
  std::string backend = "rtde";                  // or "mxt"
  std::filesystem::path model;                   // data/arms/*.toml
  ArmOptions controller;                         // host, port, rate_hz …
  Eigen::Isometry3d world_from_base = Eigen::Isometry3d::Identity();  // base_position_m, base_rpy_deg
  GuardLimits guard;
  PlanLimits plan;                               // workspace_low_m, workspace_high_m, tool_speed_m_s
  double corner_distance_m = 0;                  // the corners may be at most so far apart; 0: nobody checks
  std::string tracker = "tracker";               // section of the tracker; "" where there is none
  std::string held_corner = "right", fixed_corner = "left";
  double tracker_timeout_s = 0.5;
};

// [arm] of the configuration. Throws BadInput.
ArmConfiguration read_configuration(rig::Section keys);

// Runs until `stopping`.
void run_daemon(const rig::Configuration& configuration, const std::atomic<bool>& stopping,
                const std::string& device = "arm");

}  // namespace selvedge::arm
