#include "capture/session/arm_lease.h"

#include <random>

#include <fmt/format.h>
#include <selvedge_rig/arm_command_t.hpp>
#include <selvedge_rig/arm_control_t.hpp>
#include <selvedge_rig/arm_trajectory_t.hpp>
#include <spdlog/spdlog.h>

#include "rig/channels.h"
#include "rig/clock.h"

namespace selvedge::session {

namespace {

using selvedge_rig::arm_command_t;
using selvedge_rig::arm_control_t;
using selvedge_rig::arm_status_t;
using selvedge_rig::arm_trajectory_t;

constexpr double kLease_s = 0.1;
constexpr auto kRenewal = std::chrono::milliseconds(10);
constexpr double kArming_s = 10;
constexpr double kAskAgain_s = 0.5;
constexpr double kPlanning_s = 30;
constexpr double kStart_s = 5;  // from FOLLOW to the first motion

int64_t draw_sender() {
  std::random_device device;
  return static_cast<int64_t>((static_cast<uint64_t>(device()) << 31) ^ device()) | 1;
}

}  // namespace

ArmLease::ArmLease(RigClient& rig, const std::string& reason) : rig_(rig), sender_(draw_sender()) {
  thread_ = std::thread([this] { renew(); });
  const double until_s = rig::host_now_s() + kArming_s;
  while (true) {
    // Older than what is sent now says nothing about it.
    const int64_t asked_us = rig::host_now_us();
    control(arm_control_t::ARM, reason);
    const double answer_until_s = rig::host_now_s() + kAskAgain_s;
    while (rig::host_now_s() < answer_until_s) {
      const auto state = rig_.arm_state();
      if (state && state->armed && state->utime > asked_us) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    if (rig::host_now_s() < until_s) continue;
    ending_ = true;
    thread_.join();
    throw DeviceFailed(fmt::format("arm: not armed within {:.0f} s; {}", kArming_s, rig_.last_words("arm")));
  }
}

ArmLease::~ArmLease() {
  try {
    control(arm_control_t::DISARM, "the session lets go of the arm");
  } catch (const std::exception& error) {
    spdlog::warn("arm: {}", error.what());  // the lease ends all the same
  }
  ending_ = true;
  thread_.join();
}

void ArmLease::control(int8_t action, const std::string& reason) {
  arm_control_t message{};
  message.utime = rig::host_now_us();
  message.sender = sender_;
  message.action = action;
  message.reason = reason;
  rig_.bus().publish(rig::channel("arm", rig::kControl), message);
}

void ArmLease::renew() {
  while (!ending_) {
    arm_command_t command{};
    command.utime = rig::host_now_us();
    command.sender = sender_;
    command.lease_s = kLease_s;
    command.trajectory_id = follow_id_;
    command.action = command.trajectory_id != 0 ? arm_command_t::FOLLOW : arm_command_t::HOLD;
    try {
      rig_.bus().publish(rig::channel("arm", rig::kCommand), command);
    } catch (const std::exception& error) {
      spdlog::warn("arm: lease not renewed: {}", error.what());
    }
    std::this_thread::sleep_for(kRenewal);
  }
}

void ArmLease::prepare(const arm::ToolPath& path) {
  arm_trajectory_t message{};
  message.sender = sender_;
  message.trajectory_id = ++trajectory_id_;
  message.points = static_cast<int32_t>(path.time_s.size());
  message.time_s = path.time_s;
  for (int i = 0; i < message.points; ++i) {
    message.x_m.push_back(path.point_m(0, i));
    message.y_m.push_back(path.point_m(1, i));
    message.z_m.push_back(path.point_m(2, i));
  }
  message.utime = rig::host_now_us();
  follow_id_ = 0;
  rig_.bus().publish(rig::channel("arm", rig::kTrajectory), message);
  const double until_s = rig::host_now_s() + kPlanning_s;
  while (rig::host_now_s() < until_s) {
    const auto state = rig_.arm_state();
    if (state && !state->armed && state->utime > message.utime) throw ArmStopped("arm: " + state->stop_text);
    if (state && state->plan_id == trajectory_id_) {
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
