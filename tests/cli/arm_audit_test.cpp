// What the soak calls a motion after a stop, from the joints' speed alone.
#include "cli/verify/soak/arm_audit.h"

#include <gtest/gtest.h>

namespace selvedge::cli {
namespace {

constexpr double kLook_s = 0.02;

class Audit : public testing::Test {
 protected:
  // Joints that turn at this speed for so long.
  void turn(double speed_rad_s, double seconds) {
    for (const double end_s = now_s_ + seconds; now_s_ < end_s; now_s_ += kLook_s) audit_.look(now_s_, speed_rad_s);
  }
  void start_moving() {
    turn(0, 1);
    audit_.armed(now_s_);
    turn(0.5, 1);
  }
  ArmAudit audit_;
  double now_s_ = 100;
};

TEST_F(Audit, AnArmThatBrakesAndRestsIsStopped) {
  start_moving();
  audit_.operator_stopped(now_s_);
  turn(0.5, 0.2);
  turn(0, 60);
  EXPECT_EQ(audit_.motions_after_stop(), 0);
  EXPECT_EQ(audit_.operator_stops(), 1);
  EXPECT_NEAR(audit_.longest_after_operator_s(), 0.2, 2 * kLook_s);
}

TEST_F(Audit, APathThatRunsToItsEndIsNoStop) {
  start_moving();
  audit_.operator_stopped(now_s_);
  turn(0.5, 3);
  turn(0, 5);
  EXPECT_EQ(audit_.motions_after_stop(), 1);
}

// Whatever the daemon says: it armed again although the stop holds.
TEST_F(Audit, MotionWhileAStopHoldsCountsThoughTheDaemonSaysArmed) {
  start_moving();
  audit_.operator_stopped(now_s_);
  audit_.not_armed(now_s_ + 0.01);
  turn(0.5, 0.2);
  turn(0, 2);
  audit_.armed(now_s_);
  turn(0, 0.5);
  EXPECT_EQ(audit_.motions_after_stop(), 0);
  turn(0.5, 0.1);
  EXPECT_EQ(audit_.motions_after_stop(), 1);
}

TEST_F(Audit, AfterAPersonsWordItMayMoveAgain) {
  start_moving();
  audit_.operator_stopped(now_s_);
  audit_.not_armed(now_s_ + 0.01);
  turn(0, 2);
  audit_.operator_reset(now_s_);
  audit_.armed(now_s_ + 0.5);
  turn(0, 0.6);
  turn(0.5, 2);
  EXPECT_EQ(audit_.motions_after_stop(), 0);
}

TEST_F(Audit, ATwitchAtRestCounts) {
  turn(0, 1);
  turn(0.1, kLook_s);
  EXPECT_EQ(audit_.motions_after_stop(), 1);
}

}  // namespace
}  // namespace selvedge::cli
