// The daemon between a bus, a simulated controller and a tracker: what the arm really does.
#include "files/bad_input.h"
#include "tests/arm/arm_fixture.h"

namespace selvedge {
namespace {

using selvedge_rig::arm_command_t;
using selvedge_rig::arm_control_t;
using selvedge_rig::arm_status_t;

using ArmDaemon = tests::ArmFixture;

// Where this machine pauses for longer than the lease the arm stops, as it should; then once more.
TEST_F(ArmDaemon, WavesTheToolAlongThePath) {
  double furthest_m = 0, off_path_m = 0;
  arm_status_t end{};
  for (int attempt = 0; attempt < 10 && (attempt == 0 || end.stop_reason == arm_status_t::STOP_LEASE); ++attempt) {
    ASSERT_TRUE(start_moving({.amplitude_m = 0.05, .frequency_hz = 1, .duration_s = 4}, 0));
    furthest_m = off_path_m = 0;
    while (status().mode == arm_status_t::MODE_MOVING) {
      const Eigen::Vector3d away_m = controller_->tool_at(rig::host_now_s()) - start_m_;
      furthest_m = std::max(furthest_m, std::abs(away_m.x()));
      off_path_m = std::max(off_path_m, std::hypot(away_m.y(), away_m.z()));
      std::this_thread::sleep_for(std::chrono::milliseconds(4));
    }
    end = status();
  }
  EXPECT_EQ(end.stop_reason, arm_status_t::STOP_NONE) << end.stop_text;
  EXPECT_GT(furthest_m, 0.04);
  EXPECT_LT(furthest_m, 0.052);
  EXPECT_LT(off_path_m, 0.003);
  EXPECT_TRUE(
      wait_for([&](const auto&) { return (controller_->tool_at(rig::host_now_s()) - start_m_).norm() < 0.001; }));
}

TEST_F(ArmDaemon, CornersFurtherApartThanTheFabricAreRefusedBeforeItStarts) {
  const auto plan_text = [&](const arm::Sinusoid& sinusoid) {
    for (int attempt = 0; attempt < 10; ++attempt)
      if (arm_it() && send_path(++id_, sinusoid) == arm_status_t::PLAN_REFUSED) return status().plan_text;
    return std::string("never refused");
  };
  const std::string apart = plan_text({.amplitude_m = 0.15, .frequency_hz = 0.3, .duration_s = 6});
  EXPECT_NE(apart.find("the corners are 0.300"), std::string::npos) << apart;
  tracker_ = Tracker::silent;
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  const std::string blind = plan_text({.amplitude_m = 0.02, .frequency_hz = 0.3, .duration_s = 6});
  EXPECT_NE(blind.find("the tracker does not see"), std::string::npos) << blind;
  EXPECT_LT(controller_->fastest_since(0), 0.01);  // holding, to the encoders' noise
}

TEST_F(ArmDaemon, EachLossStopsTheArm) {
  const std::pair<const char*, std::function<void()>> losses[] = {
      {"heartbeat", [&] { heart_beats_ = false; }},
      {"connection", [&] { let_go(); }},
      {"operator", [&] { stop(); }},
      {"controller", [&] { controller_->protective_stop(); }}};
  for (const auto& [name, lose] : losses) {
    SCOPED_TRACE(name);
    controller_->clear_protective_stop();
    ASSERT_TRUE(wait_for([](const auto& status) { return status.mode != arm_status_t::MODE_OFF; }));
    reset();
    ASSERT_TRUE(wave_for_long());
    EXPECT_NE(status().holder, 0);
    lose();
    ASSERT_TRUE(wait_for([](const auto& status) { return status.mode == arm_status_t::MODE_STOPPED; }));
    heart_beats_ = true;  // somebody goes on asking
    EXPECT_LT(time_to_rest(), 2);
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    EXPECT_EQ(controller_->fastest_since(rig::host_now_s() - 0.3), 0);
    EXPECT_FALSE(status().armed);
    EXPECT_EQ(status().holder, 0);
    EXPECT_EQ(status().latched, name == std::string("operator") || name == std::string("controller"));
  }
}

// What counts is when the tracker saw the corners, not that something arrives.
TEST_F(ArmDaemon, ATrackerThatOnlySeemsToSeeStopsTheArm) {
  for (const Tracker fault : {Tracker::silent, Tracker::repeats, Tracker::fresh_times, Tracker::late,
                              Tracker::stands_still, Tracker::forged}) {
    SCOPED_TRACE(static_cast<int>(fault));
    tracker_ = Tracker::sees;
    std::this_thread::sleep_for(std::chrono::milliseconds(700));  // numbers may begin anew after a silence
    ASSERT_TRUE(wave_for_long());
    const double lost_s = rig::host_now_s();
    tracker_ = fault;
    ASSERT_TRUE(wait_for([](const auto& status) { return status.mode == arm_status_t::MODE_STOPPED; }));
    EXPECT_EQ(status().stop_reason, arm_status_t::STOP_TRACKER) << status().stop_text;
    // tracker_timeout_s is half a second; this machine may be late by as much again.
    EXPECT_LT(rig::host_now_s() - lost_s, 1.2);
  }
}

TEST(ArmConfiguration, MistakesAreRefusedByName) {
  const auto read = [](const std::string& text) {
    return arm::read_configuration(rig::Configuration::parse("[arm]\n" + text, "lab.toml").section("arm"));
  };
  EXPECT_NO_THROW(read("model = \"a.toml\"\n"));
  const auto table =
      read("model = \"a\"\n[arm.obstacle.table]\nlow_m = [0, 0, 0]\nhigh_m = [1, 2, 3]\n").plan.obstacles.at(0);
  EXPECT_EQ(table.name, "table");
  EXPECT_EQ(table.high_m, Eigen::Vector3d(1, 2, 3));
  for (const std::string text :
       {"", "model = \"a\"\nbackend = \"abb\"\n", "model = \"a\"\ncorner_distance_m = 0.3\ntracker = \"\"\n",
        "model = \"a\"\nworkspace_low_m = [1, 1, 1]\nworkspace_high_m = [0, 2, 2]\n", "model = \"a\"\nspeed = 3\n",
        "model = \"a\"\nlinks_low_m = [1, 1, 1]\nlinks_high_m = [0, 2, 2]\n",
        "model = \"a\"\n[arm.obstacle.table]\nlow_m = [0, 0, 0]\n",
        "model = \"a\"\n[arm.obstacle.table]\nlow_m = [0, 0, 0]\nhigh_m = [0, 1, 1]\n",
        "model = \"a\"\n[arm.obstacle.table]\nlow_m = [0, 0, 0]\nhigh_m = [1, 1, 1]\nradius = 2\n"})
    EXPECT_THROW(read(text), BadInput) << text;
}

}  // namespace
}  // namespace selvedge
