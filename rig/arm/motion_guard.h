// Decides, cycle by cycle, whether the arm may move and where to. Everything that keeps a person's fingers safe is
// here, without bus, clock or device, so that it can be tested whole.
//
//   off/idle ──ARM──▶ idle, armed ──FOLLOW──▶ moving ──path ends──▶ idle, armed
//      armed or moving ──lease, tracker, connection──▶ stopped, until ARM
//      armed or moving ──following error, limit, controller──▶ stopped and latched
//      any state ──an operator's stop, an intruder──▶ stopped and latched
//      latched ──RESET of that very stop, at rest──▶ idle
//
// A latched stop holds until a person resets it: nothing arms meanwhile, and an ARM older than the stop never does.
// One holder: ARM is refused while the arm is armed or moves. Obeyed are commands of the connection that armed,
// younger than their lease (at most 0.1 s), with rising sequence numbers; anything else is dropped and counted.
// A stop on a path brakes along it: the rate at which path time advances falls from 1 to 0 within stop_ramp_s.
// A fault of the arm itself drops the set-point at once.
// Path time advances by at most 2.5 periods a cycle, so that a late cycle delays the path and never jumps.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include <Eigen/Core>
#include <selvedge_rig/arm_command_t.hpp>
#include <selvedge_rig/arm_control_t.hpp>
#include <selvedge_rig/arm_status_t.hpp>

#include "rig/arm/arm.h"
#include "rig/arm/model.h"
#include "rig/arm/plan.h"

namespace selvedge::arm {

struct GuardLimits {
  double following_error_rad = 0.15;
  double stop_ramp_s = 0.15;
  double speed_margin = 1.2;  // set-points may exceed the model's joint speed by so much before a stop
  double longest_lease_s = 0.1;
  double control_age_s = 0.1;  // ARM, RESET and DISARM older than this are dropped
  double arming_grace_s = 2;   // time to the first command after arming
  double sample_age_s = 0.1;   // a moving arm's newest sample may be so old
};

class MotionGuard {
 public:
  // stop_number: of the last stop before this guard's time; the next one has the number after it.
  MotionGuard(const ArmModel& model, const GuardLimits& limits, double period_s, int64_t stop_number = 0)
      : model_(model), limits_(limits), period_s_(period_s), stop_number_(stop_number) {}

  // What came over a connection, with the host time at which it is handled. Why it is refused; "" where it is done.
  std::string on_control(const selvedge_rig::arm_control_t& control, double now_s);
  void on_command(const selvedge_rig::arm_command_t& command, double now_s);
  // "" where the trajectory is to be planned from hold_rad(); plan_ready or plan_refused follows.
  std::string on_trajectory(int64_t sender, int64_t trajectory_id, int64_t utime, double now_s);
  void plan_ready(int64_t trajectory_id, std::shared_ptr<const JointPath> path);
  void plan_refused(int64_t trajectory_id, const std::string& why);
  const Eigen::VectorXd& hold_rad() const { return set_point_rad_; }
  // A connection ended; where it held the arm, that is a stop.
  void on_closed(int64_t sender);

  // One control cycle, with the controller's newest sample where there is a new one; the set-point to send, if any.
  std::optional<Eigen::VectorXd> step(const std::optional<ArmSample>& sample, double now_s);
  // The controller cannot be reached (nothing is sent any more).
  void disconnected(const std::string& why);
  // reason: a STOP_ constant of arm_status_t. Does nothing where neither armed nor moving.
  void stop(int8_t reason, const std::string& text, bool at_once = false);
  // A stop that holds until it is reset, in every state. now_s: when it was received.
  void latch(int8_t reason, const std::string& text, double now_s, bool at_once = false);

  bool armed() const { return armed_; }
  bool moving() const { return path_ != nullptr; }
  bool latched() const { return latched_; }
  const std::string& stop_text() const { return stop_text_; }
  // Everything but pose, time and tool point.
  void fill(selvedge_rig::arm_status_t& status) const;

 private:
  bool fresh(int64_t utime, double age_s, double now_s) const;
  std::string refuse(std::string why);
  std::string arm(const selvedge_rig::arm_control_t& control, double now_s);
  std::string reset(const selvedge_rig::arm_control_t& control);
  std::string disarm(const selvedge_rig::arm_control_t& control);
  void follow(int64_t trajectory_id);
  void halt(int8_t reason, const std::string& text, bool at_once);
  void watch(const std::optional<ArmSample>& sample, double now_s);
  std::optional<Eigen::VectorXd> next_set_point(double step_s, double now_s);
  bool within_limits(const Eigen::VectorXd& next_rad, double step_s, double now_s);

  const ArmModel& model_;
  const GuardLimits limits_;
  const double period_s_;

  bool connected_ = false, ready_ = false, armed_ = false, stopped_ = false, latched_ = false;
  int64_t stop_number_ = 0;
  double latched_s_ = 0;  // when the latched stop was received
  int64_t sender_ = 0;    // who armed
  int64_t control_sender_ = 0, control_sequence_ = 0, command_sequence_ = 0;
  double lease_until_s_ = 0;
  double last_step_s_ = 0, last_sample_s_ = 0;
  Eigen::VectorXd measured_rad_;
  Eigen::VectorXd set_point_rad_;  // last one; while armed it is held
  bool sending_ = false;           // set_point_rad_ is being sent

  int64_t plan_id_ = 0;
  int8_t plan_state_ = selvedge_rig::arm_status_t::PLAN_NONE;
  std::string plan_text_;
  std::shared_ptr<const JointPath> plan_;
  std::set<int64_t> used_ids_;

  std::shared_ptr<const JointPath> path_;  // that runs
  int64_t path_id_ = 0;
  double path_time_s_ = 0, path_rate_ = 0;
  bool hold_wanted_ = false;

  int8_t stop_reason_ = selvedge_rig::arm_status_t::STOP_NONE;
  std::string stop_text_;
  int64_t refused_ = 0;
  double following_error_rad_ = 0;
};

}  // namespace selvedge::arm
