#include "rig/arm/motion_guard.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace selvedge::arm {

using selvedge_rig::arm_command_t;
using selvedge_rig::arm_control_t;
using selvedge_rig::arm_status_t;
using selvedge_rig::arm_trajectory_t;

namespace {
constexpr double kClockSlack_s = 0.005;     // a message from the future by more than this is not from our clock
constexpr double kTrajectoryAge_s = 2;      // a trajectory is long, and nothing moves by it alone
constexpr double kLongestStep_periods = 2.5;
constexpr double kSamePose_rad = 1e-6;
}  // namespace

bool MotionGuard::fresh(int64_t utime, double age_s, double now_s) const {
  const double sent_s = 1e-6 * static_cast<double>(utime);
  return sent_s <= now_s + kClockSlack_s && now_s - sent_s <= age_s;
}

void MotionGuard::on_control(const arm_control_t& control, double now_s) {
  // Anybody may stop at any time; for the rest, what is old or repeated was meant for another moment.
  if (control.action == arm_control_t::STOP) return stop(arm_status_t::STOP_OPERATOR, control.reason);
  const bool repeated = control.sender == control_sender_ && control.sequence <= control_sequence_;
  if (repeated || !fresh(control.utime, limits_.control_age_s, now_s)) {
    ++refused_;
    return;
  }
  control_sender_ = control.sender;
  control_sequence_ = control.sequence;
  if (control.action == arm_control_t::ARM) {
    arm(control, now_s);
  } else if (control.action == arm_control_t::DISARM && control.sender == sender_) {
    stop(arm_status_t::STOP_OPERATOR, "disarmed");
  } else {
    ++refused_;
  }
}

void MotionGuard::arm(const arm_control_t& control, double now_s) {
  if (!connected_ || !ready_ || moving()) {
    ++refused_;
    return;
  }
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
  const bool from_here = planned && (plan_->q_rad.front() - set_point_rad_).cwiseAbs().maxCoeff() < kSamePose_rad;
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

bool MotionGuard::on_trajectory(const arm_trajectory_t& trajectory, double now_s) {
  const bool known = armed_ && trajectory.sender == sender_;
  if (!known || moving() || trajectory.trajectory_id == 0 || used_ids_.contains(trajectory.trajectory_id) ||
      !fresh(trajectory.utime, kTrajectoryAge_s, now_s)) {
    ++refused_;
    return false;
  }
  used_ids_.insert(trajectory.trajectory_id);
  plan_id_ = trajectory.trajectory_id;
  plan_state_ = arm_status_t::PLAN_CHECKING;
  plan_text_.clear();
  plan_.reset();
  return true;
}

void MotionGuard::plan_ready(int64_t trajectory_id, JointPath path) {
  if (trajectory_id != plan_id_ || plan_state_ != arm_status_t::PLAN_CHECKING) return;
  plan_ = std::move(path);
  plan_state_ = arm_status_t::PLAN_READY;
}

void MotionGuard::plan_refused(int64_t trajectory_id, const std::string& why) {
  if (trajectory_id != plan_id_) return;
  plan_state_ = arm_status_t::PLAN_REFUSED;
  plan_text_ = why;
}

void MotionGuard::stop(int8_t reason, const std::string& text, bool at_once) {
  if (armed_ || moving()) {
    if (!stopped_) {
      stop_reason_ = reason;
      stop_text_ = text;
    }
    stopped_ = true;
    armed_ = false;
    plan_.reset();
    plan_state_ = arm_status_t::PLAN_NONE;
    if (!moving()) sending_ = false;
  }
  if (at_once) {
    path_.reset();
    path_rate_ = 0;
    sending_ = false;
  }
}

void MotionGuard::disconnected(const std::string& why) {
  stop(arm_status_t::STOP_CONNECTION, why, true);
  connected_ = ready_ = false;
}

void MotionGuard::watch(const ArmSample& sample, double now_s) {
  if (!sample.ready) stop(arm_status_t::STOP_CONTROLLER, sample.not_ready, true);
  following_error_rad_ = sending_ ? (set_point_rad_ - sample.q_rad).cwiseAbs().maxCoeff() : 0;
  if (following_error_rad_ > limits_.following_error_rad)
    stop(arm_status_t::STOP_FOLLOWING_ERROR,
         fmt::format("a joint is {:.3f} rad from its set-point, limit {} rad", following_error_rad_, limits_.following_error_rad), true);
  if (armed_ && now_s > lease_until_s_)
    stop(arm_status_t::STOP_LEASE, fmt::format("no command for {:.0f} ms", 1e3 * (now_s - lease_until_s_ + limits_.longest_lease_s)));
}

std::optional<Eigen::VectorXd> MotionGuard::step(const ArmSample& sample, double now_s) {
  const double step_s = std::clamp(now_s - last_step_s_, 0.0, kLongestStep_periods * period_s_);
  last_step_s_ = now_s;
  connected_ = true;
  ready_ = sample.ready;
  measured_rad_ = sample.q_rad;
  watch(sample, now_s);
  const bool may_move = armed_ || moving();
  auto next = next_set_point(step_s);
  // Cannot happen by the lines above; if it ever does, it is not sent, and the status says so.
  if (next && !may_move) {
    ++motions_after_stop_;
    next.reset();
  }
  sending_ = next.has_value();
  return next;
}

std::optional<Eigen::VectorXd> MotionGuard::next_set_point(double step_s) {
  if (!moving()) return armed_ ? std::optional(set_point_rad_) : std::nullopt;
  const bool brake = stopped_ || hold_wanted_;
  const double change = step_s / limits_.stop_ramp_s;
  path_rate_ = brake ? std::max(0.0, path_rate_ - change) : std::min(1.0, path_rate_ + change);
  path_time_s_ += path_rate_ * step_s;
  const Eigen::VectorXd next_rad = path_->at(path_time_s_);
  const bool over = path_time_s_ >= path_->duration_s() || (brake && path_rate_ == 0);
  if (!within_limits(next_rad, step_s)) return std::nullopt;
  set_point_rad_ = next_rad;
  if (over) path_.reset();
  return set_point_rad_;
}

// The plan has been checked against these; this is the last line before the wire.
bool MotionGuard::within_limits(const Eigen::VectorXd& next_rad, double step_s) {
  for (int joint = 0; joint < model_.joints(); ++joint) {
    const JointLimits& limit = model_.limits()[static_cast<size_t>(joint)];
    const double turn = std::abs(next_rad[joint] - set_point_rad_[joint]);
    const bool too_far = next_rad[joint] < limit.lower_rad || next_rad[joint] > limit.upper_rad;
    if (!too_far && turn <= limits_.speed_margin * limit.speed_rad_s * step_s + 1e-6) continue;
    stop(arm_status_t::STOP_LIMIT, fmt::format("set-point of joint {} at {:.3f} rad, {:.3f} rad from the last", joint + 1, next_rad[joint], turn),
         true);
    return false;
  }
  return true;
}

void MotionGuard::fill(arm_status_t& status) const {
  using Status = arm_status_t;
  status.mode = !connected_ ? Status::MODE_OFF : moving() && !stopped_ ? Status::MODE_MOVING : stopped_ ? Status::MODE_STOPPED : Status::MODE_IDLE;
  status.armed = armed_ ? 1 : 0;
  status.stop_reason = stop_reason_;
  status.stop_text = stop_text_;
  status.trajectory_id = path_id_;
  status.trajectory_s = moving() ? path_time_s_ : -1;
  status.plan_id = plan_id_;
  status.plan_state = plan_state_;
  status.plan_text = plan_text_;
  status.commands_refused = refused_;
  status.motions_after_stop = motions_after_stop_;
  status.tracking_error_rad = following_error_rad_;
}

}  // namespace selvedge::arm
