#include <functional>
#include <memory>

#include <gtest/gtest.h>

#include "rig/arm/motion_guard.h"

namespace selvedge::arm {
namespace {

using selvedge_rig::arm_command_t;
using selvedge_rig::arm_control_t;
using selvedge_rig::arm_status_t;

constexpr double kPeriod_s = 0.008;
constexpr int64_t kSender = 77;

// The guard with an arm that follows each set-point exactly, and a clock that the test turns.
class Guard : public testing::Test {
 protected:
  void SetUp() override {
    sample_.q_rad = model_.home_rad();
    sample_.qd_rad_s = Eigen::VectorXd::Zero(6);
    sample_.ready = true;
    cycle();
  }

  int64_t utime() const { return std::llround(now_s_ * 1e6); }

  std::string control(int8_t action, int64_t sender = kSender, double age_s = 0) {
    arm_control_t message{};
    message.stop_number = status().stop_number;
    message.utime = utime() - std::llround(age_s * 1e6);
    message.sequence = ++control_sequence_;
    message.sender = sender;
    message.action = action;
    return guard_->on_control(message, now_s_);
  }
  void command(int8_t action, int64_t id = 0, int64_t sender = kSender, double age_s = 0) {
    last_ = {};
    last_.utime = utime() - std::llround(age_s * 1e6);
    last_.sequence = ++command_sequence_;
    last_.sender = sender;
    last_.lease_s = 0.1;
    last_.action = action;
    last_.trajectory_id = id;
    guard_->on_command(last_, now_s_);
  }
  // Sends and plans a waving path.
  void plan_waving(int64_t id) {
    if (!guard_->on_trajectory(kSender, id, utime(), now_s_).empty()) return;
    const Eigen::Vector3d start_m = model_.base_from_tool(guard_->hold_rad()).translation();
    guard_->plan_ready(id, std::make_shared<JointPath>(
                               plan(model_, guard_->hold_rad(), make_sinusoid(start_m, {.duration_s = 4}), {})));
  }
  // One control cycle; true where a set-point was sent.
  bool cycle(bool arm_follows = true) {
    now_s_ += kPeriod_s;
    const auto set_point = guard_->step(sample_, now_s_);
    moved_rad_ = set_point ? (*set_point - sample_.q_rad).cwiseAbs().maxCoeff() : 0;
    if (set_point && arm_follows) sample_.q_rad = *set_point;
    return set_point.has_value();
  }
  void start_moving() {
    if (!guard_->armed()) control(arm_control_t::ARM);
    plan_waving(1);
    command(arm_command_t::FOLLOW, 1);
    run(0.8);
    ASSERT_EQ(status().mode, arm_status_t::MODE_MOVING);
    ASSERT_GT(moved_rad_, 1e-5);
  }
  // Cycles with a heartbeat.
  void run(double seconds) {
    for (double t = 0; t < seconds; t += kPeriod_s) {
      command(arm_command_t::FOLLOW, 1);
      cycle();
    }
  }
  arm_status_t status() const {
    arm_status_t status{};
    guard_->fill(status);
    return status;
  }
  // Cycles until nothing is sent any more; how long that took, s.
  double time_to_rest() {
    const double from_s = now_s_;
    while (cycle() && now_s_ < from_s + 10) {}
    return now_s_ - from_s;
  }

  const ArmModel model_ = ArmModel::read(SELVEDGE_SOURCE_DIR "/data/arms/ur5e.toml");
  std::unique_ptr<MotionGuard> guard_ = std::make_unique<MotionGuard>(model_, GuardLimits{}, kPeriod_s);
  ArmSample sample_;
  double now_s_ = 1000, moved_rad_ = 0;
  int64_t control_sequence_ = 0, command_sequence_ = 0;
  arm_command_t last_;
};

TEST_F(Guard, NothingMovesUnlessArmed) {
  plan_waving(1);
  command(arm_command_t::FOLLOW, 1);
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(cycle());
  EXPECT_EQ(status().commands_refused, 2);
}

TEST_F(Guard, RunsAPathToItsEndUnderALease) {
  control(arm_control_t::ARM);
  plan_waving(1);
  command(arm_command_t::FOLLOW, 1);
  run(5);
  EXPECT_EQ(status().mode, arm_status_t::MODE_IDLE);
  EXPECT_TRUE(guard_->armed());
  EXPECT_EQ(status().trajectory_id, 1);
  EXPECT_EQ(status().trajectory_s, -1);
  // Back where it began, since the path is ramped out.
  EXPECT_LT((sample_.q_rad - model_.home_rad()).cwiseAbs().maxCoeff(), 1e-4);
}

TEST_F(Guard, LeaseEndsWithinAHundredMilliseconds) {
  start_moving();
  const double silence_s = time_to_rest();
  // 100 ms of lease, 150 ms of braking, and a cycle for each.
  EXPECT_LT(silence_s, 0.1 + 0.15 + 3 * kPeriod_s);
  EXPECT_EQ(status().stop_reason, arm_status_t::STOP_LEASE);
  EXPECT_EQ(status().mode, arm_status_t::MODE_STOPPED);
}

TEST_F(Guard, AfterAStopNothingMovesUntilItIsResetAndTheArmArmedAnew) {
  start_moving();
  control(arm_control_t::STOP, 12345);  // from anybody
  cycle();
  EXPECT_NE(control(arm_control_t::RESET).find("still brakes"), std::string::npos);
  time_to_rest();
  EXPECT_EQ(status().stop_reason, arm_status_t::STOP_OPERATOR);
  plan_waving(2);
  for (int i = 0; i < 200; ++i) {
    command(arm_command_t::FOLLOW, i % 3);
    EXPECT_FALSE(cycle());
    EXPECT_NE(control(arm_control_t::ARM).find("until a person resets it"), std::string::npos);
  }
  EXPECT_EQ(control(arm_control_t::RESET), "");
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(cycle());  // a reset moves nothing by itself
  EXPECT_EQ(control(arm_control_t::ARM), "");
  EXPECT_TRUE(cycle());  // holds
  EXPECT_EQ(moved_rad_, 0);
}

TEST_F(Guard, BrakesAlongThePathWithoutAJerk) {
  start_moving();
  double before_rad = moved_rad_;
  control(arm_control_t::STOP);
  while (cycle()) {
    // The rate falls by kPeriod/0.15 = 5 % of full speed a cycle; the path's own curvature adds a little.
    EXPECT_LT(std::abs(moved_rad_ - before_rad), 1.5e-3);
    before_rad = moved_rad_;
  }
}

TEST_F(Guard, StaleRepeatedAndForeignCommandsAreDroppedAndCounted) {
  start_moving();
  const auto refused = status().commands_refused;
  guard_->on_command(last_, now_s_);                // repeated
  command(arm_command_t::FOLLOW, 1, 99);            // unknown sender
  command(arm_command_t::FOLLOW, 1, kSender, 0.2);  // stale
  command(arm_command_t::FOLLOW, 1, kSender, -1);   // from the future
  command(arm_command_t::FOLLOW, 5);                // a trajectory nobody planned
  EXPECT_EQ(status().commands_refused, refused + 5);
  arm_command_t greedy = last_;
  greedy.sequence = ++command_sequence_;
  greedy.utime = utime();
  greedy.trajectory_id = 1;
  greedy.lease_s = 60;
  guard_->on_command(greedy, now_s_);
  EXPECT_EQ(status().commands_refused, refused + 6);
}

TEST_F(Guard, RecordedArmingDoesNotArm) {
  control(arm_control_t::ARM, kSender, 0.5);
  EXPECT_FALSE(guard_->armed());
  arm_control_t message{};
  message.utime = utime();
  message.sequence = ++control_sequence_;
  message.sender = kSender;
  message.action = arm_control_t::ARM;
  guard_->on_control(message, now_s_);
  EXPECT_TRUE(guard_->armed());
  control(arm_control_t::STOP);
  cycle();
  control(arm_control_t::RESET);
  EXPECT_FALSE(guard_->latched());
  guard_->on_control(message, now_s_);  // the same message once more
  EXPECT_FALSE(guard_->armed());
}

TEST_F(Guard, FollowingErrorDropsTheSetPointAtOnce) {
  start_moving();
  sample_.q_rad[2] += 0.3;
  EXPECT_FALSE(cycle());
  EXPECT_EQ(status().stop_reason, arm_status_t::STOP_FOLLOWING_ERROR);
  EXPECT_FALSE(guard_->moving());
}

TEST_F(Guard, ControllersOwnStopIsAStop) {
  start_moving();
  sample_.ready = false;
  sample_.not_ready = "safety mode 3";
  EXPECT_FALSE(cycle());
  EXPECT_EQ(status().stop_reason, arm_status_t::STOP_CONTROLLER);
  EXPECT_EQ(status().stop_text, "safety mode 3");
  sample_.ready = true;
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(cycle());  // coming back does not move it
  EXPECT_NE(control(arm_control_t::ARM), "");
  EXPECT_EQ(control(arm_control_t::RESET), "");
  EXPECT_EQ(control(arm_control_t::ARM), "");
  EXPECT_TRUE(cycle());
}

TEST_F(Guard, LostConnectionIsAStop) {
  start_moving();
  guard_->disconnected("cable");
  EXPECT_EQ(status().mode, arm_status_t::MODE_OFF);
  EXPECT_FALSE(cycle());
  EXPECT_EQ(status().stop_reason, arm_status_t::STOP_CONNECTION);
}

TEST_F(Guard, LateCycleDelaysThePathAndNeverJumps) {
  start_moving();
  now_s_ += 0.06;  // the machine slept; the lease still holds
  command(arm_command_t::FOLLOW, 1);
  const double before_rad = moved_rad_;
  ASSERT_TRUE(cycle());
  EXPECT_LT(moved_rad_, 3 * before_rad + 1e-3);
  EXPECT_EQ(status().mode, arm_status_t::MODE_MOVING);
}

TEST_F(Guard, HoldBrakesAndStaysArmed) {
  start_moving();
  for (int i = 0; i < 60; ++i) {
    command(arm_command_t::HOLD);
    cycle();
  }
  EXPECT_EQ(moved_rad_, 0);
  EXPECT_TRUE(guard_->armed());
  EXPECT_EQ(status().mode, arm_status_t::MODE_IDLE);
}

TEST_F(Guard, RefusedPlanIsNotFollowedAndSaysWhy) {
  control(arm_control_t::ARM);
  ASSERT_EQ(guard_->on_trajectory(kSender, 4, utime(), now_s_), "");
  EXPECT_NE(guard_->on_trajectory(kSender, 5, utime(), now_s_), "");  // one at a time
  guard_->plan_refused(4, "at 1.2 s …");
  command(arm_command_t::FOLLOW, 4);
  cycle();
  EXPECT_FALSE(guard_->moving());
  EXPECT_EQ(status().plan_state, arm_status_t::PLAN_REFUSED);
  EXPECT_EQ(status().plan_text, "at 1.2 s …");
  EXPECT_NE(guard_->on_trajectory(kSender, 4, utime(), now_s_), "");  // never twice
  EXPECT_EQ(guard_->on_trajectory(kSender, 5, utime(), now_s_), "");
}

TEST_F(Guard, AMeasuredAngleThatIsNotFiniteStopsForGood) {
  for (int joint = 0; joint < model_.joints(); ++joint) {
    start_moving();
    const double before_rad = sample_.q_rad[joint];
    sample_.q_rad[joint] = std::nan("");
    EXPECT_FALSE(cycle()) << joint;
    EXPECT_TRUE(guard_->latched());
    EXPECT_EQ(status().stop_reason, arm_status_t::STOP_CONTROLLER) << status().stop_text;
    cycle();
    EXPECT_EQ(control(arm_control_t::RESET), "");
    cycle();
    EXPECT_NE(control(arm_control_t::ARM), "") << "it would be held where nobody knows";
    sample_.q_rad[joint] = before_rad;
    cycle();
  }
}

// Whatever the guard did when the stop came, it holds: nothing arms until that very stop is reset by a later word.
TEST_F(Guard, AStopLatchesInEveryState) {
  const std::pair<const char*, std::function<void()>> states[] = {
      {"off", [&] { guard_->disconnected("no cable"); }},
      {"idle", [] {}},
      {"armed", [&] { control(arm_control_t::ARM); }},
      {"planning", [&] { control(arm_control_t::ARM), guard_->on_trajectory(kSender, 1, utime(), now_s_); }},
      {"planned", [&] { control(arm_control_t::ARM), plan_waving(1); }},
      {"moving", [&] { start_moving(); }},
      {"path ended", [&] { start_moving(), run(5); }},
      {"stopped by the lease", [&] { start_moving(), time_to_rest(); }},
      {"latched already", [&] { control(arm_control_t::STOP); }}};
  for (const auto& [name, enter] : states) {
    SCOPED_TRACE(name);
    guard_ = std::make_unique<MotionGuard>(model_, GuardLimits{}, kPeriod_s);
    sample_.q_rad = model_.home_rad();
    cycle();
    enter();
    EXPECT_EQ(control(arm_control_t::STOP, 999), "");
    const int64_t number = status().stop_number;
    time_to_rest();
    EXPECT_TRUE(guard_->latched());
    for (int i = 0; i < 100; ++i) {
      EXPECT_NE(control(arm_control_t::ARM, kSender + i), "");
      command(arm_command_t::FOLLOW, 1);
      EXPECT_FALSE(cycle());
    }
    arm_control_t other{};  // a word for another stop, and one from before this one
    other.action = arm_control_t::RESET;
    other.utime = utime();
    other.sequence = ++control_sequence_;
    other.stop_number = number + 1;
    EXPECT_NE(guard_->on_control(other, now_s_), "");
    EXPECT_TRUE(guard_->latched());
    EXPECT_EQ(control(arm_control_t::RESET), "");
    EXPECT_EQ(control(arm_control_t::ARM), "");
    EXPECT_TRUE(cycle());
  }
}

TEST_F(Guard, AnArmFromBeforeTheStopNeverArms) {
  arm_control_t early{};
  early.action = arm_control_t::ARM;
  early.utime = utime();
  early.sender = 5;
  early.sequence = 1;
  cycle();
  control(arm_control_t::STOP);
  cycle();
  EXPECT_EQ(control(arm_control_t::RESET), "");
  EXPECT_NE(guard_->on_control(early, now_s_).find("older than the last stop"), std::string::npos);
  EXPECT_FALSE(guard_->armed());
}

TEST_F(Guard, OneHolderAtATime) {
  control(arm_control_t::ARM);
  EXPECT_NE(control(arm_control_t::ARM, 99).find("one holder"), std::string::npos);
  EXPECT_NE(control(arm_control_t::DISARM, 99), "");
  start_moving();  // refused too: the holder itself is armed already
  EXPECT_NE(control(arm_control_t::ARM, 99), "");
  command(arm_command_t::FOLLOW, 1);
  cycle();
  EXPECT_EQ(status().mode, arm_status_t::MODE_MOVING);
  guard_->on_closed(99);  // somebody else's connection
  cycle();
  EXPECT_EQ(status().mode, arm_status_t::MODE_MOVING);
  guard_->on_closed(kSender);
  time_to_rest();
  EXPECT_EQ(status().stop_reason, arm_status_t::STOP_LEASE);
  EXPECT_FALSE(guard_->latched());  // no person stopped it
  EXPECT_EQ(control(arm_control_t::ARM, 99), "");
}

TEST_F(Guard, LettingGoAtRestIsNoStop) {
  control(arm_control_t::ARM);
  cycle();
  EXPECT_EQ(control(arm_control_t::DISARM), "");
  EXPECT_FALSE(cycle());
  EXPECT_EQ(status().mode, arm_status_t::MODE_IDLE);
  EXPECT_EQ(control(arm_control_t::ARM, 99), "");
}

// Samples stay away, set-points go on: the lease, the stop and the samples' age are looked at all the same.
TEST_F(Guard, CyclesWithoutASampleBrakeAsWell) {
  for (const bool stopped : {true, false}) {
    SCOPED_TRACE(stopped);
    control(arm_control_t::RESET);
    start_moving();
    if (stopped) control(arm_control_t::STOP);
    const double from_s = now_s_;
    std::optional<Eigen::VectorXd> sent;
    do {
      now_s_ += kPeriod_s;
      if (!stopped) command(arm_command_t::FOLLOW, 1);
      sent = guard_->step(std::nullopt, now_s_);
      if (sent) sample_.q_rad = *sent;
    } while (sent && now_s_ < from_s + 5);
    EXPECT_LT(now_s_ - from_s, (stopped ? 0 : 0.1) + 0.15 + 4 * kPeriod_s);
    EXPECT_EQ(status().stop_reason, stopped ? arm_status_t::STOP_OPERATOR : arm_status_t::STOP_CONNECTION);
  }
}

TEST_F(Guard, SomebodyElseAtTheScriptPortIsAStopThatHolds) {
  sample_.intruder = "a second connection";
  cycle();
  sample_.intruder.clear();
  EXPECT_TRUE(guard_->latched());
  EXPECT_EQ(status().stop_reason, arm_status_t::STOP_INTRUDER);
  EXPECT_NE(control(arm_control_t::ARM), "");
}

}  // namespace
}  // namespace selvedge::arm
