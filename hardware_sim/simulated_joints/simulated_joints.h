// The joints of a simulated arm: they follow a target with a lag, within limits, and remember where they were.
//
//   wanted speed = (target − q)/lag, limited to the joint's speed; its change limited to the joint's acceleration.
// Without a target the joints brake at that acceleration. History is kept for the last seconds, so that a tracker
// with a latency can ask where the tool was.
#pragma once

#include <deque>
#include <mutex>
#include <optional>
#include <set>

#include <Eigen/Core>

#include "rig/arm/model.h"

namespace selvedge::hardware_sim {

class SimulatedJoints {
 public:
  // Starts at the model's home position, at rest, at host time now_s.
  SimulatedJoints(const arm::ArmModel& model, double lag_s, double now_s);

  // Moves on to host time now_s. A late call is made up for in small steps.
  void advance(const std::optional<Eigen::VectorXd>& target_rad, double now_s);
  // True where a target lies outside a joint's range, or further from q than `factor` times its speed covers in the
  // lag.
  bool violates(const Eigen::VectorXd& target_rad, double factor) const;
  void block(int joint, bool blocked);

  // From any thread. Times of the last kHistory_s seconds; clamped beyond.
  Eigen::VectorXd joints_at(double host_time_s) const;
  Eigen::VectorXd speeds() const;
  Eigen::Vector3d tool_at(double host_time_s) const;
  double fastest_since(double host_time_s) const;  // rad/s, over all joints

  static constexpr double kHistory_s = 10;

 private:
  struct Moment {
    double time_s;
    Eigen::VectorXd q_rad;
    double fastest_rad_s;
  };
  void small_step(const std::optional<Eigen::VectorXd>& target_rad, double step_s);

  const arm::ArmModel model_;
  const double lag_s_;
  mutable std::mutex mutex_;
  double time_s_;
  Eigen::VectorXd q_rad_, qd_rad_s_;
  std::set<int> blocked_;
  std::deque<Moment> history_;
};

}  // namespace selvedge::hardware_sim
