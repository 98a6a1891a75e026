#include "rig/arm/motion_guard.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace selvedge::arm {

using selvedge_rig::arm_command_t;
using selvedge_rig::arm_control_t;
using selvedge_rig::arm_status_t;

namespace {
constexpr double kClockSlack_s = 0.005;  // a message from the future by more than this is not from our clock
constexpr double kTrajectoryAge_s = 2;   // a trajectory is long, and nothing moves by it alone
constexpr double kLongestStep_periods = 2.5;
constexpr double kSamePose_rad = 1e-6;
}  // namespace

bool MotionGuard::fresh(int64_t utime, double age_s, double now_s) const {
  const double sent_s = 1e-6 * static_cast<double>(utime);
  return sent_s <= now_s + kClockSlack_s && now_s - sent_s <= age_s;
}

std::string MotionGuard::refuse(std::string why) {
  ++refused_;
  return why;
}

std::string MotionGuard::on_control(const arm_control_t& control, double now_s) {
  // Anybody may stop at any time; for the rest, what is old or repeated was meant for another moment.
  if (control.action == arm_control_t::STOP) {
    latch(arm_status_t::STOP_OPERATOR, control.reason, now_s);
    return "";
  }
  if (control.sender == control_sender_ && control.sequence <= control_sequence_) return refuse("it was sent before");
  if (!fresh(control.utime, limits_.control_age_s, now_s))
    return refuse(fmt::format("it was sent {:.2f} s ago, at most {} s",
                              now_s - 1e-6 * static_cast<double>(control.utime), limits_.control_age_s));
  control_sender_ = control.sender;
  control_sequence_ = control.sequence;
  switch (control.action) {
    case arm_control_t::ARM: return arm(control, now_s);
    case arm_control_t::DISARM: return disarm(control);
    case arm_control_t::RESET: return reset(control);
    default: return refuse(fmt::format("there is no action {}", control.action));
  }
}

std::string MotionGuard::arm(const arm_control_t& control, double now_s) {
  if (latched_) return refuse(fmt::format("stop {} holds until a person resets it: {}", stop_number_, stop_text_));
  if (1e-6 * static_cast<double>(control.utime) <= latched_s_) return refuse("it is older than the last stop");
  if (armed_ || moving()) return refuse("the arm is armed already: one holder at a time");
  if (!connected_ || !ready_) return refuse("the controller is not ready");
  armed_ = true;
  stopped_ = false;
  stop_reason_ = arm_status_t::STOP_NONE;
  stop_text_.clear();
  sender_ = control.sender;
  command_sequence_ = 0;
  lease_until_s_ = now_s + limits_.arming_grace_s;
  plan_.reset();
  plan_state_ = arm_status_t::PLAN_NONE;
  used_ids_.clear();  // another sender counts anew
  path_id_ = 0;
  set_point_rad_ = measured_rad_;
  return "";
}

std::string MotionGuard::disarm(const arm_control_t& control) {
  if (!armed_ || control.sender != sender_) return refuse("whoever sends this does not hold the arm");
  if (moving()) {
    stop(arm_status_t::STOP_LEASE, "let go of on its way: " + control.reason);
  } else {  // at rest that is no stop
    armed_ = false;
    sending_ = false;
  }
  return "";
}

std::string MotionGuard::reset(const arm_control_t& control) {
  if (!latched_) return refuse("no stop holds");
  if (control.stop_number != stop_number_)
    return refuse(
        fmt::format("stop {} holds, not {}: look again before resetting it", stop_number_, control.stop_number));
  if (1e-6 * static_cast<double>(control.utime) <= latched_s_) return refuse("it is older than the stop");
  if (moving()) return refuse("the arm still brakes");
  latched_ = stopped_ = false;
  return "";
}

void MotionGuard::on_command(const arm_command_t& command, double now_s) {
  const bool known = armed_ && command.sender == sender_ && command.sequence > command_sequence_;
  const bool leased = command.lease_s > 0 && command.lease_s <= limits_.longest_lease_s + 1e-9;
  if (!known || !leased || !fresh(command.utime, command.lease_s, now_s)) {
    ++refused_;
    return;
  }
  command_sequence_ = command.sequence;
  lease_until_s_ = 1e-6 * static_cast<double>(command.utime) + command.lease_s;
  if (command.action == arm_command_t::HOLD) {
    hold_wanted_ = true;
  } else if (command.action == arm_command_t::FOLLOW) {
    follow(command.trajectory_id);
  } else {
    ++refused_;
  }
}

void MotionGuard::follow(int64_t trajectory_id) {
  if (moving() && trajectory_id == path_id_) {
    hold_wanted_ = false;
    return;
  }
  if (!moving() && trajectory_id != 0 && trajectory_id == path_id_) return;  // it has run; the lease is renewed
  const bool planned = plan_ && trajectory_id == plan_id_ && plan_state_ == arm_status_t::PLAN_READY;
  const bool from_here = planned && (plan_->at(0) - set_point_rad_).cwiseAbs().maxCoeff() < kSamePose_rad;
  if (moving() || !from_here) {
    ++refused_;
    return;
  }
  path_ = std::move(plan_);
  plan_.reset();
  path_id_ = trajectory_id;
  path_time_s_ = 0;
  path_rate_ = 1;  // the path itself starts at rest
  hold_wanted_ = false;
}

std::string MotionGuard::on_trajectory(int64_t sender, int64_t trajectory_id, int64_t utime, double now_s) {
  if (!armed_ || sender != sender_) return refuse("whoever sends this does not hold the arm");
  if (moving()) return refuse("the arm moves");
  if (plan_state_ == arm_status_t::PLAN_CHECKING) return refuse("another path is being checked");
  if (trajectory_id == 0 || used_ids_.contains(trajectory_id))
    return refuse(fmt::format("trajectory_id {}: a new one other than 0 expected", trajectory_id));
  if (!fresh(utime, kTrajectoryAge_s, now_s)) return refuse("it was sent too long ago");
  used_ids_.insert(trajectory_id);
  plan_id_ = trajectory_id;
  plan_state_ = arm_status_t::PLAN_CHECKING;
  plan_text_.clear();
  plan_.reset();
  return "";
}

void MotionGuard::plan_ready(int64_t trajectory_id, std::shared_ptr<const JointPath> path) {
  if (trajectory_id != plan_id_ || plan_state_ != arm_status_t::PLAN_CHECKING) return;
  plan_ = std::move(path);
  plan_state_ = arm_status_t::PLAN_READY;
}

void MotionGuard::plan_refused(int64_t trajectory_id, const std::string& why) {
  if (trajectory_id != plan_id_ || plan_state_ != arm_status_t::PLAN_CHECKING) return;
  plan_state_ = arm_status_t::PLAN_REFUSED;
  plan_text_ = why;
}

void MotionGuard::on_closed(int64_t sender) {
  if (sender == sender_) stop(arm_status_t::STOP_LEASE, "the connection of whoever held the arm has ended");
}

// The first reason stands: what follows from a stop does not rename it.
void MotionGuard::halt(int8_t reason, const std::string& text, bool at_once) {
  if (!stopped_) {
    stop_reason_ = reason;
    stop_text_ = text;
  }
  stopped_ = true;
  armed_ = false;
  plan_.reset();
  plan_state_ = arm_status_t::PLAN_NONE;
  if (!moving() || at_once) {
    path_.reset();
    path_rate_ = 0;
    sending_ = false;
  }
}

void MotionGuard::stop(int8_t reason, const std::string& text, bool at_once) {
  if (armed_ || moving()) halt(reason, text, at_once);
}

void MotionGuard::latch(int8_t reason, const std::string& text, double now_s, bool at_once) {
  // Each has a number of its own: whoever resets must have seen the last of them.
  ++stop_number_;
  if (!latched_) stopped_ = false;
  latched_ = true;
  latched_s_ = std::max(latched_s_, now_s);
  halt(reason, text, at_once);
}

void MotionGuard::disconnected(const std::string& why) {
  stop(arm_status_t::STOP_CONNECTION, why, true);
  connected_ = ready_ = false;
}

void MotionGuard::watch(const std::optional<ArmSample>& sample, double now_s) {
  const bool at_stake = armed_ || moving();
  following_error_rad_ = sending_ ? (set_point_rad_ - measured_rad_).cwiseAbs().maxCoeff<Eigen::PropagateNaN>() : 0;
  if (sample && !sample->intruder.empty()) latch(arm_status_t::STOP_INTRUDER, sample->intruder, now_s);
  if (at_stake && sample && !ready_)
    latch(arm_status_t::STOP_CONTROLLER,
          sample->ready ? "the controller measures a joint angle that is not finite" : sample->not_ready, now_s, true);
  if (at_stake && !(following_error_rad_ <= limits_.following_error_rad))
    latch(arm_status_t::STOP_FOLLOWING_ERROR,
          fmt::format("a joint is {:.3f} rad from its set-point, limit {} rad", following_error_rad_,
                      limits_.following_error_rad),
          now_s, true);
  if (now_s - last_sample_s_ > limits_.sample_age_s)
    stop(arm_status_t::STOP_CONNECTION, fmt::format("the controller's newest sample is {:.2f} s old, limit {} s",
                                                    now_s - last_sample_s_, limits_.sample_age_s));
  if (armed_ && now_s > lease_until_s_)
    stop(arm_status_t::STOP_LEASE,
         fmt::format("no command for {:.0f} ms", 1e3 * (now_s - lease_until_s_ + limits_.longest_lease_s)));
}

std::optional<Eigen::VectorXd> MotionGuard::step(const std::optional<ArmSample>& sample, double now_s) {
  const double step_s = std::clamp(now_s - last_step_s_, 0.0, kLongestStep_periods * period_s_);
  last_step_s_ = now_s;
  if (sample) {
    connected_ = true;
    ready_ = sample->ready && sample->q_rad.allFinite();
    measured_rad_ = sample->q_rad;
    last_sample_s_ = now_s;
  }
  watch(sample, now_s);
  auto next = next_set_point(step_s, now_s);
  sending_ = next.has_value();
  return next;
}

std::optional<Eigen::VectorXd> MotionGuard::next_set_point(double step_s, double now_s) {
  if (!moving()) return armed_ ? std::optional(set_point_rad_) : std::nullopt;
  const bool brake = stopped_ || hold_wanted_;
  const double change = step_s / limits_.stop_ramp_s;
  path_rate_ = brake ? std::max(0.0, path_rate_ - change) : std::min(1.0, path_rate_ + change);
  path_time_s_ += path_rate_ * step_s;
  const Eigen::VectorXd next_rad = path_->at(path_time_s_);
  const bool over = path_time_s_ >= path_->duration_s() || (brake && path_rate_ == 0);
  if (!within_limits(next_rad, step_s, now_s)) return std::nullopt;
  set_point_rad_ = next_rad;
  if (over) path_.reset();
  return set_point_rad_;
}

// The plan has been checked against these; this is the last line before the wire.
bool MotionGuard::within_limits(const Eigen::VectorXd& next_rad, double step_s, double now_s) {
  for (int joint = 0; joint < model_.joints(); ++joint) {
    const JointLimits& limit = model_.limits()[static_cast<size_t>(joint)];
    const double turn = std::abs(next_rad[joint] - set_point_rad_[joint]);
    const bool in_range = next_rad[joint] >= limit.lower_rad && next_rad[joint] <= limit.upper_rad;
    if (in_range && turn <= limits_.speed_margin * limit.speed_rad_s * step_s + 1e-6) continue;
    latch(
        arm_status_t::STOP_LIMIT,
        fmt::format("set-point of joint {} at {:.3f} rad, {:.3f} rad from the last", joint + 1, next_rad[joint], turn),
        now_s, true);
    return false;
  }
  return true;
}

void MotionGuard::fill(arm_status_t& status) const {
  using Status = arm_status_t;
  status.mode = !connected_             ? Status::MODE_OFF
                : moving() && !stopped_ ? Status::MODE_MOVING
                : stopped_ || latched_  ? Status::MODE_STOPPED
                                        : Status::MODE_IDLE;
  status.armed = armed_ ? 1 : 0;
  status.holder = armed_ ? sender_ : 0;
  status.latched = latched_ ? 1 : 0;
  status.stop_number = stop_number_;
  status.stop_reason = stop_reason_;
  status.stop_text = stop_text_;
  status.trajectory_id = path_id_;
  status.trajectory_s = moving() ? path_time_s_ : -1;
  status.plan_id = plan_id_;
  status.plan_state = plan_state_;
  status.plan_text = plan_text_;
  status.commands_refused = refused_;
  status.tracking_error_rad = following_error_rad_;
}

}  // namespace selvedge::arm
