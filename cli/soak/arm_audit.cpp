#include "cli/soak/arm_audit.h"

#include <algorithm>

namespace selvedge::cli {

void ArmAudit::note(double host_s, bool allowed) {
  const std::lock_guard lock(mutex_);
  // Of one moment, leave to move counts.
  auto& noted = notes_.try_emplace(host_s, allowed).first->second;
  noted = noted || allowed;
}

void ArmAudit::begin_stop(double host_s) {
  state_ = State::braking;
  stopped_s_ = host_s;
  quiet_since_s_ = -1;
  ++stops_;
}

void ArmAudit::look(double host_s, double speed_rad_s) {
  {
    const std::lock_guard lock(mutex_);
    while (!notes_.empty() && notes_.begin()->first <= host_s) {
      if (notes_.begin()->second) state_ = State::allowed;
      else if (state_ == State::allowed) begin_stop(notes_.begin()->first);
      notes_.erase(notes_.begin());
    }
  }
  if (state_ == State::resting && speed_rad_s > kMoving_rad_s) {
    ++motions_;
    state_ = State::reported;
  }
  if (state_ != State::braking) return;
  if (speed_rad_s > kResting_rad_s) quiet_since_s_ = -1;
  else if (quiet_since_s_ < 0) quiet_since_s_ = host_s;
  if (quiet_since_s_ >= 0 && host_s - quiet_since_s_ >= kRest_s) {
    state_ = State::resting;
    longest_braking_s_ = std::max(longest_braking_s_, quiet_since_s_ - stopped_s_);
  } else if (host_s - stopped_s_ > kLongestBraking_s) {
    ++motions_;
    state_ = State::reported;
  }
}

}  // namespace selvedge::cli
