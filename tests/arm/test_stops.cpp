// An operator's stop, measured at the joints of the simulated controller: it comes through everything, and it is final.
#include <sys/wait.h>

#include <array>
#include <set>

#include "tests/arm/arm_fixture.h"

namespace selvedge {
namespace {

using selvedge_rig::arm_command_t;
using selvedge_rig::arm_control_t;
using selvedge_rig::arm_status_t;

using Stops = tests::ArmFixture;

// What a client that means harm, or has gone mad, would send.
void send_raw(const wire::Socket& socket, const arm_control_t& message) {
  socket.send(arm::encode_frame(arm::FrameKind::control, message));
}

TEST_F(Stops, BeforeTenThousandMessagesBringsTheArmToRest) {
  // 100 of 100 on a quiet machine (docs/safety.md); here fewer, and what a slow machine adds is allowed for.
  std::vector<double> rests_s;
  for (int round = 0; round < 10; ++round) {
    reset();
    ASSERT_TRUE(wave_for_long());
    const wire::Socket flood = wire::connect_unix(socket_);
    arm_control_t message{};
    message.action = arm_control_t::STOP;
    message.reason = "before the flood";
    send_raw(flood, message);
    const double stopped_s = rig::host_now_s();
    message.action = arm_control_t::ARM;
    std::thread flooding([&] {
      try {
        for (int i = 0; i < 10000; ++i) {
          message.sequence = i;
          message.utime = rig::host_now_us();
          send_raw(flood, message);
        }
      } catch (const wire::Disconnected&) {
        // It never reads its answers, so the daemon may well hang up on it.
      }
    });
    const double late_s = rig::host_now_s() - stopped_s;
    rests_s.push_back(late_s + time_to_rest());
    flooding.join();
    EXPECT_TRUE(status().latched);
    EXPECT_FALSE(status().armed);
  }
  std::sort(rests_s.begin(), rests_s.end());
  EXPECT_LT(rests_s[rests_s.size() / 2], 0.4);
  EXPECT_LT(rests_s.back(), 1.5);
  RecordProperty("median_rest_ms", static_cast<int>(1e3 * rests_s[rests_s.size() / 2]));
}

TEST_F(Stops, HoldOverTheEndOfTheDaemon) {
  stop();
  end_daemon();
  start_daemon();
  EXPECT_TRUE(status().latched);
  EXPECT_NE(status().stop_text.find("before the daemon was started again: test"), std::string::npos)
      << status().stop_text;
  EXPECT_THROW(client().arm("test"), arm::ControlRefused);
  reset();
  let_go();
  end_daemon();
  start_daemon();
  EXPECT_FALSE(status().latched);
}

TEST_F(Stops, ASecondSenderGetsNothing) {
  ASSERT_TRUE(wave_for_long());
  arm::ControlClient second(socket_);
  EXPECT_THROW(second.arm("I too"), arm::ControlRefused);
  EXPECT_THROW(second.disarm("not yours"), arm::ControlRefused);
  EXPECT_THROW(second.send(to_message(1000, arm::make_sinusoid(start_m_, {.duration_s = 4}))), arm::ControlRefused);
  arm_command_t command{};
  command.lease_s = 0.1;
  command.action = arm_command_t::HOLD;
  for (int i = 0; i < 20; ++i) second.command(command);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_GE(status().commands_refused, 20);
  if (status().stop_reason != arm_status_t::STOP_LEASE) {  // this machine may have paused
    EXPECT_EQ(status().mode, arm_status_t::MODE_MOVING);
  }
}

// The process of another user may stop the arm where the folders let it reach the socket, and do nothing else.
TEST_F(Stops, AnotherUserMayStopAndNothingElse) {
  ASSERT_TRUE(wave_for_long());
  if (::geteuid() != 0) {
    // Nobody else can be had without root: the daemon's list of users is tried in ControlServer.OthersMayStopAlone.
    SUCCEED();
    return;
  }
  std::filesystem::permissions(folder_, std::filesystem::perms::others_exec | std::filesystem::perms::others_read,
                               std::filesystem::perm_options::add);
  const auto as_nobody = [&](auto action) {
    const pid_t child = ::fork();
    if (child == 0) {
      int outcome = 3;
      if (::setgid(65534) == 0 && ::setuid(65534) == 0) {
        try {
          arm::ControlClient other(socket_);
          action(other);
          outcome = 0;
        } catch (const arm::ControlRefused&) { outcome = 1; } catch (...) {
          outcome = 2;
        }
      }
      ::_exit(outcome);
    }
    int ended = 0;
    ::waitpid(child, &ended, 0);
    return WEXITSTATUS(ended);
  };
  EXPECT_EQ(as_nobody([](arm::ControlClient& other) { other.arm("nobody"); }), 1);
  EXPECT_EQ(as_nobody([](arm::ControlClient& other) { other.reset(1, "nobody"); }), 1);
  EXPECT_EQ(as_nobody([](arm::ControlClient& other) { other.send({}); }), 1);
  EXPECT_EQ(as_nobody([](arm::ControlClient& other) { other.stop("nobody"); }), 0);
  EXPECT_TRUE(wait_for([](const auto& status) { return status.latched; }));
  EXPECT_NE(status().stop_text.find("nobody"), std::string::npos) << status().stop_text;
}

TEST_F(Stops, AStrangerAtTheScriptPortGetsNoSetPointAndStopsTheArm) {
  ASSERT_TRUE(wave_for_long());
  const wire::Socket stranger = wire::connect_tcp("127.0.0.1", script_port_, 1);
  ASSERT_TRUE(wait_for([](const auto& status) { return status.latched; }));
  EXPECT_EQ(status().stop_reason, arm_status_t::STOP_INTRUDER) << status().stop_text;
  EXPECT_LT(time_to_rest(), 2);
  std::array<std::uint8_t, 64> bytes;
  size_t got = 0;
  try {
    while (stranger.readable(0.2)) got += stranger.receive(bytes);
  } catch (const wire::Disconnected&) {
    // turned away
  }
  EXPECT_EQ(got, 0u);
  // The robot's own script is still the one that is heard.
  reset();
  EXPECT_TRUE(wave_for_long());
}

// Two of the longest paths that the daemon plans, one after another: the loop keeps its beat.
TEST_F(Stops, PlanningNeverHoldsUpControl) {
  ASSERT_TRUE(arm_it());
  double longest_gap_s = 0, longest_own_s = 0;  // between states of the arm, and between looks of this thread
  std::atomic<bool> done = false;
  std::mutex mutex;
  std::vector<double> arrived_s;
  rig::Bus bus(configuration_.bus());
  bus.subscribe<arm_status_t>("ARM_ARM", [&](const auto& message) {
    const std::lock_guard lock(mutex);
    arrived_s.push_back(1e-6 * static_cast<double>(message.utime));
  });
  bus.start();
  std::thread idle([&] {
    for (double before_s = rig::host_now_s(); !done;) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      const double now_s = rig::host_now_s();
      longest_own_s = std::max(longest_own_s, now_s - before_s);
      before_s = now_s;
    }
  });
  const auto path = to_message(0, arm::make_sinusoid(start_m_, {.amplitude_m = 0.02, .duration_s = 600}));
  for (int64_t id : {7001, 7002}) {
    auto message = path;
    message.trajectory_id = id;
    try {
      client().send(message);
    } catch (const std::runtime_error&) {
      // The first is still being checked: the second is refused at once.
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
  done = true;
  idle.join();
  {
    const std::lock_guard lock(mutex);
    for (size_t i = 1; i < arrived_s.size(); ++i)
      longest_gap_s = std::max(longest_gap_s, arrived_s[i] - arrived_s[i - 1]);
    EXPECT_GT(arrived_s.size(), 20u);
  }
  RecordProperty("longest_gap_ms", static_cast<int>(1e3 * longest_gap_s));
  // Two periods of 8 ms, and what the machine itself paused for.
  EXPECT_LT(longest_gap_s, 0.016 + 0.004 + longest_own_s);
}

}  // namespace
}  // namespace selvedge
