// The daemon between a bus, a simulated controller and a tracker: what the arm really does.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <mutex>
#include <thread>

#include <fmt/format.h>
#include <selvedge_rig/corner_sample_t.hpp>

#include "files/bad_input.h"
#include "hardware_sim/rtde_controller/rtde_controller.h"
#include "rig/arm/daemon.h"
#include "rig/bus.h"
#include "rig/clock.h"
#include "rig/network.h"
#include "rig/wire/socket.h"

namespace selvedge {
namespace {

using selvedge_rig::arm_command_t;
using selvedge_rig::arm_control_t;
using selvedge_rig::arm_status_t;
using selvedge_rig::arm_trajectory_t;

// Tests run beside each other; the bus tells them apart by its port alone.
const int kBusPort = 20000 + ::getpid() % 20000;
constexpr int64_t kSender = 4711;

class ArmDaemon : public testing::Test {
 protected:
  void SetUp() override {
    if (!rig::multicast_works(kBusPort)) GTEST_SKIP() << rig::multicast_advice();
    hardware_sim::RtdeControllerOptions options;
    options.script_port = wire::local_port(wire::listen_tcp("127.0.0.1", 0));
    controller_ = std::make_unique<hardware_sim::RtdeController>(options, model_);
    start_m_ = home_m_;
    configuration_ = rig::Configuration::parse(
        fmt::format("[bus]\nport = {}\n[arm]\nmodel = \"{}/data/arms/ur5e.toml\"\nport = {}\nscript_port = {}\n"
                    "corner_distance_m = 0.3\nbase_position_m = [1.0, 2.0, 0.5]\nbase_rpy_deg = [0, 0, 90]\n",
                    kBusPort, SELVEDGE_SOURCE_DIR, controller_->port(), options.script_port),
        "test.toml");
    bus_ = std::make_unique<rig::Bus>(configuration_.bus());
    bus_->subscribe<arm_status_t>("ARM_ARM", [this](const auto& message) {
      const std::lock_guard lock(mutex_);
      status_ = message;
    });
    bus_->start();
    session_ = std::thread([this] { run_session(); });
    daemon_ = std::thread([this] { arm::run_daemon(configuration_, stopping_); });
  }
  void TearDown() override {
    stopping_ = true;
    if (daemon_.joinable()) daemon_.join();
    if (session_.joinable()) session_.join();
    bus_.reset();  // its thread fills what the test holds
  }

  // The tracker's samples and the session's heartbeat, 100 a second.
  void run_session() {
    const arm::ArmConfiguration own = arm::read_configuration(configuration_.section("arm"));
    while (!stopping_) {
      if (tracker_sees_) {
        const Eigen::Vector3d right_m = own.world_from_base * controller_->tool_at(rig::host_now_s());
        const Eigen::Vector3d left_m = own.world_from_base * (home_m_ - Eigen::Vector3d(0.2, 0, 0));
        selvedge_rig::corner_sample_t sample{};
        sample.utime = rig::host_now_us();
        sample.count = 2;
        sample.name = {"left", "right"};
        sample.x_m = {left_m.x(), right_m.x()};
        sample.y_m = {left_m.y(), right_m.y()};
        sample.z_m = {left_m.z(), right_m.z()};
        sample.occluded = {0, 0};
        bus_->publish("TRACKER_CORNERS", sample);
      }
      if (heart_beats_) {
        arm_command_t command{};
        command.utime = rig::host_now_us();
        command.sender = kSender;
        command.lease_s = 0.1;
        command.action = follow_ != 0 ? arm_command_t::FOLLOW : arm_command_t::HOLD;
        command.trajectory_id = follow_;
        bus_->publish("ARM_COMMAND", command);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }

  arm_status_t status() {
    const std::lock_guard lock(mutex_);
    return status_;
  }
  template <class Condition>
  bool wait_for(Condition condition, double limit_s = 20) {
    const double end_s = rig::host_now_s() + limit_s;
    while (rig::host_now_s() < end_s) {
      if (condition(status())) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

  void control(int8_t action) {
    arm_control_t message{};
    message.utime = rig::host_now_us();
    message.sender = kSender;
    message.action = action;
    message.reason = "test";
    bus_->publish("ARM_CONTROL", message);
  }
  // Arms, with the heart beating; again where a busy machine let the lease run out.
  bool arm_it() {
    heart_beats_ = true;
    return wait_for([this](const auto& status) {
      if (status.armed) return true;
      if (status.mode != arm_status_t::MODE_OFF) control(arm_control_t::ARM);
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      return false;
    });
  }
  int8_t send_path(int64_t id, const arm::Sinusoid& sinusoid) {
    const auto path = arm::make_sinusoid(start_m_, sinusoid);
    arm_trajectory_t message{};
    message.utime = rig::host_now_us();
    message.sender = kSender;
    message.trajectory_id = id;
    message.points = static_cast<int32_t>(path.time_s.size());
    message.time_s = path.time_s;
    for (long i = 0; i < path.point_m.cols(); ++i) {
      message.x_m.push_back(path.point_m(0, i));
      message.y_m.push_back(path.point_m(1, i));
      message.z_m.push_back(path.point_m(2, i));
    }
    bus_->publish("ARM_TRAJECTORY", message);
    wait_for([&](const auto& status) {
      return !status.armed || (status.plan_id == id && status.plan_state >= arm_status_t::PLAN_READY);
    });
    return status().plan_state;
  }

  // Arms, sends a path from where the tool is and follows it until path time `until_s`. Several tries, since on a
  // busy machine the lease may run out at any moment, as it should.
  bool start_moving(const arm::Sinusoid& sinusoid, double until_s) {
    for (int attempt = 0; attempt < 10; ++attempt) {
      follow_ = 0;
      wait_for([&](const auto&) { return controller_->fastest_since(rig::host_now_s() - 0.2) < 0.01; });
      start_m_ = controller_->tool_at(rig::host_now_s());
      if (!arm_it() || send_path(++id_, sinusoid) != arm_status_t::PLAN_READY) continue;
      follow_ = id_;
      wait_for([&](const auto& status) { return status.trajectory_s > until_s || !status.armed; });
      if (status().mode == arm_status_t::MODE_MOVING) return true;
    }
    return false;
  }

  const arm::ArmModel model_ = arm::ArmModel::read(SELVEDGE_SOURCE_DIR "/data/arms/ur5e.toml");
  const Eigen::Vector3d home_m_ = model_.base_from_tool(model_.home_rad()).translation();
  int64_t id_ = 0;
  Eigen::Vector3d start_m_;
  std::unique_ptr<hardware_sim::RtdeController> controller_;
  rig::Configuration configuration_;
  std::mutex mutex_;
  arm_status_t status_{};
  std::atomic<bool> stopping_ = false, tracker_sees_ = true, heart_beats_ = false;
  std::atomic<int64_t> follow_ = 0;
  std::unique_ptr<rig::Bus> bus_;
  std::thread daemon_, session_;
};

TEST_F(ArmDaemon, WavesTheToolAlongThePath) {
  ASSERT_TRUE(start_moving({.amplitude_m = 0.05, .frequency_hz = 1, .duration_s = 4}, 0));
  double furthest_m = 0, off_path_m = 0;
  while (status().mode == arm_status_t::MODE_MOVING) {
    const Eigen::Vector3d away_m = controller_->tool_at(rig::host_now_s()) - start_m_;
    furthest_m = std::max(furthest_m, std::abs(away_m.x()));
    off_path_m = std::max(off_path_m, std::hypot(away_m.y(), away_m.z()));
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
  }
  const auto end = status();
  if (end.stop_reason == arm_status_t::STOP_LEASE) GTEST_SKIP() << "this machine paused for longer than the lease";
  EXPECT_EQ(end.stop_reason, arm_status_t::STOP_NONE) << end.stop_text;
  EXPECT_GT(furthest_m, 0.04);
  EXPECT_LT(furthest_m, 0.052);
  EXPECT_LT(off_path_m, 0.003);
  EXPECT_TRUE(wait_for([&](const auto&) { return (controller_->tool_at(rig::host_now_s()) - start_m_).norm() < 0.001; }));
}

TEST_F(ArmDaemon, CornersFurtherApartThanTheFabricAreRefusedBeforeItStarts) {
  const auto plan_text = [&](const arm::Sinusoid& sinusoid) {
    for (int attempt = 0; attempt < 10; ++attempt)
      if (arm_it() && send_path(++id_, sinusoid) == arm_status_t::PLAN_REFUSED) return status().plan_text;
    return std::string("never refused");
  };
  const std::string apart = plan_text({.amplitude_m = 0.15, .frequency_hz = 0.3, .duration_s = 6});
  EXPECT_NE(apart.find("the corners are 0.300"), std::string::npos) << apart;
  tracker_sees_ = false;
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  const std::string blind = plan_text({.amplitude_m = 0.02, .frequency_hz = 0.3, .duration_s = 6});
  EXPECT_NE(blind.find("the tracker does not see"), std::string::npos) << blind;
  EXPECT_LT(controller_->fastest_since(0), 0.01);  // holding, to the encoders' noise
}

TEST_F(ArmDaemon, EachLossStopsTheArmForGood) {
  const std::pair<const char*, std::function<void()>> losses[] = {
      {"heartbeat", [&] { heart_beats_ = false; }},
      {"tracker", [&] { tracker_sees_ = false; }},
      {"operator", [&] { control(arm_control_t::STOP); }},
      {"controller", [&] { controller_->protective_stop(); }}};
  for (const auto& [name, lose] : losses) {
    SCOPED_TRACE(name);
    controller_->clear_protective_stop();
    tracker_sees_ = true;
    ASSERT_TRUE(wait_for([](const auto& status) { return status.mode != arm_status_t::MODE_OFF; }));
    ASSERT_TRUE(start_moving({.amplitude_m = 0.02, .frequency_hz = 1, .duration_s = 20}, 1));
    lose();
    ASSERT_TRUE(wait_for([](const auto& status) { return status.mode == arm_status_t::MODE_STOPPED; }));
    heart_beats_ = true;  // somebody goes on asking
    std::this_thread::sleep_for(std::chrono::milliseconds(800));
    EXPECT_EQ(controller_->fastest_since(rig::host_now_s() - 0.3), 0);
    EXPECT_FALSE(status().armed);
    EXPECT_EQ(status().motions_after_stop, 0);
  }
}

TEST(ArmConfiguration, MistakesAreRefusedByName) {
  const auto read = [](const std::string& text) {
    return arm::read_configuration(rig::Configuration::parse("[arm]\n" + text, "lab.toml").section("arm"));
  };
  EXPECT_NO_THROW(read("model = \"a.toml\"\n"));
  for (const std::string text : {"", "model = \"a\"\nbackend = \"abb\"\n", "model = \"a\"\ncorner_distance_m = 0.3\ntracker = \"\"\n",
                                 "model = \"a\"\nworkspace_low_m = [1, 1, 1]\nworkspace_high_m = [0, 2, 2]\n", "model = \"a\"\nspeed = 3\n"})
    EXPECT_THROW(read(text), BadInput) << text;
}

}  // namespace
}  // namespace selvedge
