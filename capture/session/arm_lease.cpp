#include "capture/session/arm_lease.h"

#include <fmt/format.h>
#include <selvedge_rig/arm_command_t.hpp>
#include <selvedge_rig/arm_trajectory_t.hpp>
#include <spdlog/spdlog.h>

#include "rig/clock.h"

namespace selvedge::session {

namespace {

using selvedge_rig::arm_command_t;
using selvedge_rig::arm_status_t;
using selvedge_rig::arm_trajectory_t;

constexpr double kLease_s = 0.1;
constexpr auto kRenewal = std::chrono::milliseconds(10);
constexpr double kArming_s = 10;
constexpr double kAskAgain_s = 0.5;
constexpr double kPlanning_s = 30;
constexpr double kStart_s = 5;  // from FOLLOW to the first motion

}  // namespace

// A daemon that is started again, or a controller that is not ready yet, may be there soon; a stop that holds is not
// lifted by waiting.
ArmLease::ArmLease(RigClient& rig, const std::string& reason) : rig_(rig) {
  std::string why;
  for (const double until_s = rig::host_now_s() + kArming_s; rig::host_now_s() < until_s;) {
    require_no_stop(rig);
    try {
      if (!control_) control_ = std::make_unique<arm::ControlClient>(rig.arm_socket());
      control_->arm(reason);
      thread_ = std::thread([this] { renew(); });
      return;
    } catch (const arm::ControlRefused& refused) { why = refused.what(); } catch (const wire::Disconnected& gone) {
      control_.reset();
      why = gone.what();
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(kAskAgain_s));
  }
  throw DeviceFailed(fmt::format("arm: not armed within {:.0f} s: {}; {}", kArming_s, why, rig_.last_words("arm")));
}

ArmLease::~ArmLease() {
  ending_ = true;
  thread_.join();
  try {
    control_->disarm("the session lets go of the arm");
  } catch (const std::exception&) {
    // It holds the arm no more, or the daemon is gone; the connection's end lets go of it all the same.
  }
}

void ArmLease::renew() {
  while (!ending_) {
    arm_command_t command{};
    command.lease_s = kLease_s;
    command.trajectory_id = follow_id_;
    command.action = command.trajectory_id != 0 ? arm_command_t::FOLLOW : arm_command_t::HOLD;
    try {
      control_->command(command);
    } catch (const std::exception& error) {
      spdlog::warn("arm: lease not renewed: {}", error.what());
      lost_ = true;
      return;
    }
    std::this_thread::sleep_for(kRenewal);
  }
}

void ArmLease::prepare(const arm::ToolPath& path) {
  arm_trajectory_t message{};
  message.trajectory_id = ++trajectory_id_;
  message.points = static_cast<int32_t>(path.time_s.size());
  message.time_s = path.time_s;
  for (int i = 0; i < message.points; ++i) {
    message.x_m.push_back(path.point_m(0, i));
    message.y_m.push_back(path.point_m(1, i));
    message.z_m.push_back(path.point_m(2, i));
  }
  follow_id_ = 0;
  try {
    message.utime = control_->send(message);
  } catch (const arm::ControlRefused& refused) { throw ArmStopped(refused.what()); }
  const double until_s = rig::host_now_s() + kPlanning_s;
  while (rig::host_now_s() < until_s) {
    const auto state = rig_.arm_state();
    if (state && !state->armed && state->utime > message.utime) throw ArmStopped("arm: " + state->stop_text);
    if (state && state->plan_id == trajectory_id_ && state->utime > message.utime) {
      if (state->plan_state == arm_status_t::PLAN_READY) return;
      if (state->plan_state == arm_status_t::PLAN_REFUSED) throw DeviceFailed("arm: path refused: " + state->plan_text);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  throw DeviceFailed(fmt::format("arm: path not checked within {:.0f} s; {}", kPlanning_s, rig_.last_words("arm")));
}

void ArmLease::follow() {
  seen_moving_ = false;
  followed_s_ = rig::host_now_s();
  follow_id_ = trajectory_id_;
}

bool ArmLease::moving() {
  const auto state = rig_.arm_state();
  const double now_s = rig::host_now_s();
  if (lost_) throw ArmStopped("arm: its daemon is gone; " + rig_.last_words("arm"));
  if (!state) return true;
  if (1e-6 * static_cast<double>(state->utime) < followed_s_) {
    if (now_s - followed_s_ > kStart_s) throw ArmStopped("arm: silent; " + rig_.last_words("arm"));
    return true;
  }
  if (!state->armed) throw ArmStopped("arm: stopped: " + state->stop_text);
  if (state->mode == arm_status_t::MODE_MOVING) seen_moving_ = true;
  else if (seen_moving_) return false;
  else if (now_s - followed_s_ > kStart_s) throw ArmStopped("arm: does not follow the path; " + rig_.last_words("arm"));
  return true;
}

}  // namespace selvedge::session
