#include "hardware_sim/simulated_joints/simulated_joints.h"

#include <algorithm>
#include <cmath>

namespace selvedge::hardware_sim {

namespace {
constexpr double kStep_s = 0.002;
}

SimulatedJoints::SimulatedJoints(const arm::ArmModel& model, double lag_s, double now_s)
    : model_(model), lag_s_(lag_s), time_s_(now_s), q_rad_(model.home_rad()),
      qd_rad_s_(Eigen::VectorXd::Zero(model.joints())) {
  history_.push_back({time_s_, q_rad_, 0});
}

void SimulatedJoints::advance(const std::optional<Eigen::VectorXd>& target_rad, double now_s) {
  const std::lock_guard lock(mutex_);
  while (time_s_ + kStep_s <= now_s) {
    small_step(target_rad, kStep_s);
    time_s_ += kStep_s;
    history_.push_back({time_s_, q_rad_, qd_rad_s_.cwiseAbs().maxCoeff()});
  }
  while (history_.size() > 2 && history_.front().time_s < now_s - kHistory_s) history_.pop_front();
}

void SimulatedJoints::small_step(const std::optional<Eigen::VectorXd>& target_rad, double step_s) {
  for (int joint = 0; joint < model_.joints(); ++joint) {
    const arm::JointLimits& limit = model_.limits()[static_cast<size_t>(joint)];
    double wanted = 0;
    if (target_rad) {
      const double left = (*target_rad)[joint] - q_rad_[joint];
      // Slow enough to stop at the target with the acceleration there is.
      const double stoppable = std::sqrt(2 * limit.acceleration_rad_s2 * std::abs(left));
      wanted = std::clamp(left / lag_s_, -stoppable, stoppable);
      wanted = std::clamp(wanted, -limit.speed_rad_s, limit.speed_rad_s);
    }
    const double change = limit.acceleration_rad_s2 * step_s;
    qd_rad_s_[joint] = std::clamp(wanted, qd_rad_s_[joint] - change, qd_rad_s_[joint] + change);
    if (blocked_.contains(joint)) qd_rad_s_[joint] = 0;
    q_rad_[joint] = std::clamp(q_rad_[joint] + qd_rad_s_[joint] * step_s, limit.lower_rad, limit.upper_rad);
  }
}

bool SimulatedJoints::violates(const Eigen::VectorXd& target_rad, double factor) const {
  const std::lock_guard lock(mutex_);
  for (int joint = 0; joint < model_.joints(); ++joint) {
    const arm::JointLimits& limit = model_.limits()[static_cast<size_t>(joint)];
    const double target = target_rad[joint];
    if (!(target >= limit.lower_rad && target <= limit.upper_rad)) return true;
    if (!blocked_.contains(joint) && std::abs(target - q_rad_[joint]) > factor * limit.speed_rad_s * lag_s_)
      return true;
  }
  return false;
}

void SimulatedJoints::block(int joint, bool blocked) {
  const std::lock_guard lock(mutex_);
  if (blocked) blocked_.insert(joint);
  else blocked_.erase(joint);
}

Eigen::VectorXd SimulatedJoints::joints_at(double host_time_s) const {
  const std::lock_guard lock(mutex_);
  const auto after = std::upper_bound(history_.begin(), history_.end(), host_time_s,
                                      [](double t, const Moment& moment) { return t < moment.time_s; });
  if (after == history_.begin()) return history_.front().q_rad;
  if (after == history_.end()) return history_.back().q_rad;
  const auto before = std::prev(after);
  const double x = (host_time_s - before->time_s) / (after->time_s - before->time_s);
  return (1 - x) * before->q_rad + x * after->q_rad;
}

Eigen::VectorXd SimulatedJoints::speeds() const {
  const std::lock_guard lock(mutex_);
  return qd_rad_s_;
}

Eigen::Vector3d SimulatedJoints::tool_at(double host_time_s) const {
  return model_.base_from_tool(joints_at(host_time_s)).translation();
}

double SimulatedJoints::fastest_since(double host_time_s) const {
  const std::lock_guard lock(mutex_);
  double fastest = 0;
  for (const Moment& moment : history_)
    if (moment.time_s >= host_time_s) fastest = std::max(fastest, moment.fastest_rad_s);
  return fastest;
}

}  // namespace selvedge::hardware_sim
