// Holds the arm's lease for as long as it lives: arms on construction, renews the lease from a thread of its own,
// disarms on destruction. If this process dies, or the machine stalls for longer than the lease, the arm stops by
// itself (rig/arm/motion_guard.h). Where a stop holds it does not let itself be armed (operator_stop.h).
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "capture/session/operator_stop.h"
#include "capture/session/rig_client.h"
#include "rig/arm/control_link.h"
#include "rig/arm/path.h"

namespace selvedge::session {

class ArmLease {
 public:
  // Only on an operator's word, which `reason` quotes. Throws DeviceFailed where the arm does not let itself be armed.
  ArmLease(RigClient& rig, const std::string& reason);
  ~ArmLease();
  ArmLease(const ArmLease&) = delete;
  ArmLease& operator=(const ArmLease&) = delete;

  // Sends a path of the tool point (arm base frame) and waits until the daemon has checked all of it.
  // Throws DeviceFailed with the limit and time that it would break first. Nothing moves.
  void prepare(const arm::ToolPath& path);
  // Runs the prepared path; returns at once.
  void follow();
  // False once the path has been run to its end. Throws ArmStopped.
  bool moving();

 private:
  void renew();

  RigClient& rig_;
  std::unique_ptr<arm::ControlClient> control_;
  std::atomic<int64_t> follow_id_{0};  // 0: hold
  int64_t trajectory_id_ = 0;
  bool seen_moving_ = false;
  double followed_s_ = 0;
  std::atomic<bool> ending_{false}, lost_{false};
  std::thread thread_;
};

}  // namespace selvedge::session
