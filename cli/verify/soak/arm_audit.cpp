#include "cli/verify/soak/arm_audit.h"

#include <algorithm>

namespace selvedge::cli {

void ArmAudit::note(double host_s, Event event) {
  const std::lock_guard lock(mutex_);
  notes_.emplace(host_s, event);
}

void ArmAudit::begin_stop(double host_s, bool by_operator) {
  state_ = State::braking;
  stopped_s_ = host_s;
  quiet_since_s_ = -1;
  by_operator_ = by_operator;
  ++stops_;
  stops_in_motion_ += speed_rad_s_ > kMoving_rad_s;
}

void ArmAudit::apply(double host_s, Event event) {
  const bool before = armed_ && !held_;
  if (event == Event::stopped) held_ = true, ++operator_stops_;
  else if (event == Event::reset) held_ = false;
  else armed_ = event == Event::armed;
  const bool now = armed_ && !held_;
  if (now) state_ = State::allowed;
  else if (before) begin_stop(host_s, event == Event::stopped);
}

void ArmAudit::look(double host_s, double speed_rad_s) {
  {
    const std::lock_guard lock(mutex_);
    while (!notes_.empty() && notes_.begin()->first <= host_s) {
      apply(notes_.begin()->first, notes_.begin()->second);
      notes_.erase(notes_.begin());
    }
  }
  speed_rad_s_ = speed_rad_s;
  if (state_ == State::resting && speed_rad_s > kMoving_rad_s) {
    ++motions_;
    state_ = State::reported;
  }
  if (state_ != State::braking) return;
  if (speed_rad_s > kResting_rad_s) quiet_since_s_ = -1;
  else if (quiet_since_s_ < 0) quiet_since_s_ = host_s;
  if (quiet_since_s_ >= 0 && host_s - quiet_since_s_ >= kRest_s) {
    state_ = State::resting;
    longest_s_ = std::max(longest_s_, quiet_since_s_ - stopped_s_);
    if (by_operator_) longest_operator_s_ = std::max(longest_operator_s_, quiet_since_s_ - stopped_s_);
  } else if (host_s - stopped_s_ > kLongestBraking_s) {
    ++motions_;
    state_ = State::reported;
  }
}

}  // namespace selvedge::cli
