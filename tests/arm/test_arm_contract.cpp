// What every arm back-end has to do, run over each of them beside its simulated controller.
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <memory>
#include <ostream>
#include <thread>
#include <vector>

#include "hardware_sim/mxt_controller/mxt_controller.h"
#include "hardware_sim/rtde_controller/rtde_controller.h"
#include "rig/arm/arm.h"
#include "rig/arm/model.h"
#include "rig/clock.h"
#include "rig/wire/bytes.h"
#include "rig/wire/socket.h"

namespace selvedge {
namespace {

struct Controller {
  arm::ArmModel model;
  std::function<std::unique_ptr<arm::Arm>()> connect;
  std::function<Eigen::VectorXd(double)> joints_at;
  std::function<double(double)> fastest_since;
  std::function<void()> break_down;  // the controller stops by itself
  std::function<void()> repair;
};

struct Backend {
  std::string name;
  std::function<Controller()> start;
};
void PrintTo(const Backend& backend, std::ostream* out) { *out << backend.name; }

arm::ArmModel read(const char* file) {
  return arm::ArmModel::read(std::string(SELVEDGE_SOURCE_DIR) + "/data/arms/" + file);
}

Controller start_rtde() {
  const auto model = read("ur5e.toml");
  hardware_sim::RtdeControllerOptions options;
  options.script_port = wire::local_port(wire::listen_tcp("127.0.0.1", 0));
  auto simulated = std::make_shared<hardware_sim::RtdeController>(options, model);
  arm::ArmOptions client;
  client.port = simulated->port();
  client.script_port = options.script_port;
  client.controller_timeout_s = 0.4;  // a busy machine may pause
  return {.model = model,
          .connect = [client] { return arm::connect_rtde(client); },
          .joints_at = [simulated](double t) { return simulated->joints_at(t); },
          .fastest_since = [simulated](double t) { return simulated->fastest_since(t); },
          .break_down = [simulated] { simulated->protective_stop(); },
          .repair = [simulated] { simulated->clear_protective_stop(); }};
}

Controller start_mxt() {
  const auto model = read("pa10.toml");
  hardware_sim::MxtControllerOptions options;
  options.silence_s = 0.4;  // a busy machine may pause
  auto simulated = std::make_shared<hardware_sim::MxtController>(options, model);
  arm::ArmOptions client;
  client.port = simulated->port();
  client.joints = model.joints();
  client.controller_timeout_s = options.silence_s;
  return {.model = model,
          .connect = [client] { return arm::connect_mxt(client); },
          .joints_at = [simulated](double t) { return simulated->joints_at(t); },
          .fastest_since = [simulated](double t) { return simulated->fastest_since(t); },
          .break_down = [simulated] { simulated->raise_alarm(); },
          .repair = [simulated] { simulated->restart_program(); }};
}

class ArmContract : public testing::TestWithParam<Backend> {
 protected:
  // Cycles without a set-point until the controller would follow one.
  static arm::ArmSample wait_ready(arm::Arm& arm) {
    for (int i = 0; i < 2000; ++i)
      if (const auto sample = arm.cycle(std::nullopt, 0.1); sample && sample->ready) return *sample;
    throw std::runtime_error("the controller never got ready");
  }
};

TEST_P(ArmContract, SaysWhereTheJointsAreAndWhen) {
  const Controller controller = GetParam().start();
  const auto arm = controller.connect();
  for (int i = 0; i < 20; ++i) {
    const auto sample = arm->cycle(std::nullopt, 1);
    ASSERT_TRUE(sample);
    ASSERT_EQ(sample->q_rad.size(), controller.model.joints());
    EXPECT_LT((sample->q_rad - controller.model.home_rad()).cwiseAbs().maxCoeff(), 1e-3);
    EXPECT_LE(sample->time_s, rig::host_now_s() + 0.01);
  }
}

TEST_P(ArmContract, StandsStillWithoutASetPoint) {
  const Controller controller = GetParam().start();
  const auto arm = controller.connect();
  const double from_s = rig::host_now_s();
  wait_ready(*arm);
  for (int i = 0; i < 30; ++i) arm->cycle(std::nullopt, 0.1);
  EXPECT_EQ(controller.fastest_since(from_s), 0);
}

TEST_P(ArmContract, GoesWhereItIsToldWithALag) {
  const Controller controller = GetParam().start();
  const auto arm = controller.connect();
  const auto start = wait_ready(*arm);
  Eigen::VectorXd set_point = start.q_rad;
  for (int i = 0; i < 150; ++i) {
    const double x = i / 149.0;
    set_point[1] = start.q_rad[1] + 0.1 * x * x * (3 - 2 * x);
    set_point[3] = start.q_rad[3] - 0.1 * x * x * (3 - 2 * x);
    arm->cycle(set_point, 0.1);
  }
  std::optional<arm::ArmSample> sample;
  for (int i = 0; i < 200; ++i)
    if ((sample = arm->cycle(set_point, 0.1)) && (sample->q_rad - set_point).cwiseAbs().maxCoeff() < 1e-3) break;
  ASSERT_TRUE(sample);
  EXPECT_LT((sample->q_rad - set_point).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LT((controller.joints_at(rig::host_now_s()) - set_point).cwiseAbs().maxCoeff(), 1e-3);
}

TEST_P(ArmContract, ControllersOwnStopIsSaidAndItCanBeRepaired) {
  const Controller controller = GetParam().start();
  auto arm = controller.connect();
  wait_ready(*arm);
  controller.break_down();
  bool said = false;
  try {
    for (int i = 0; i < 1000 && !said; ++i) {
      const auto sample = arm->cycle(std::nullopt, 0.05);
      said = sample && !sample->ready && !sample->not_ready.empty();
    }
  } catch (const wire::Disconnected&) { said = true; }
  EXPECT_TRUE(said);
  arm.reset();
  // Saying goodbye ends a controller's program, perhaps only after the repair.
  for (int i = 0; i < 5 && !arm; ++i) {
    controller.repair();
    try {
      arm = controller.connect();
    } catch (const wire::Disconnected&) {}
  }
  ASSERT_TRUE(arm);
  EXPECT_TRUE(wait_ready(*arm).ready);
}

TEST_P(ArmContract, SilenceOfTheDaemonStopsTheArm) {
  const Controller controller = GetParam().start();
  const auto arm = controller.connect();
  const auto start = wait_ready(*arm);
  Eigen::VectorXd set_point = start.q_rad;
  for (int i = 0; i < 40; ++i) {
    set_point[0] += 0.002;
    arm->cycle(set_point, 0.1);
  }
  const double silent_s = rig::host_now_s();
  while (rig::host_now_s() < silent_s + 1.2) {
    timespec nap{0, 20000000};
    ::nanosleep(&nap, nullptr);
  }
  EXPECT_GT(controller.fastest_since(silent_s - 0.5), 0.05);
  EXPECT_EQ(controller.fastest_since(silent_s + 0.8), 0);
}

// A daemon that dies must stop the arm, so a controller that would wait for it for ever is none to drive.
TEST(Mxt, AControllerThatNeverGivesUpIsRefused) {
  const auto model = read("pa10.toml");
  hardware_sim::MxtControllerOptions options;
  options.silence_s = 1e9;
  hardware_sim::MxtController endless(options, model);
  arm::ArmOptions client;
  client.port = endless.port();
  client.joints = model.joints();
  try {
    arm::connect_mxt(client);
    FAIL() << "connected";
  } catch (const wire::WireError& refused) {
    EXPECT_NE(std::string(refused.what()).find("MXTTOUT"), std::string::npos) << refused.what();
  }
  EXPECT_LT(endless.fastest_since(0), 1e-4);  // trying it moves nothing but the rounding of a float
}

// This process plays the robot's script, which ends and comes anew between two cycles: whoever drives hears of the end
// before the next is taken.
TEST(Rtde, AScriptThatComesAnewIsToldAsOneThatEnded) {
  hardware_sim::RtdeControllerOptions options;
  options.script_port = 1;  // its own script finds nobody
  hardware_sim::RtdeController simulated(options, read("ur5e.toml"));
  arm::ArmOptions client;
  client.port = simulated.port();
  client.script_port = wire::local_port(wire::listen_tcp("127.0.0.1", 0));
  const auto arm = arm::connect_rtde(client);
  wire::Socket script = wire::connect_tcp("127.0.0.1", client.script_port, 1);
  const auto next = [&] {
    for (int i = 0; i < 100; ++i)
      if (const auto sample = arm->cycle(std::nullopt, 0.1)) return *sample;
    throw std::runtime_error("no sample");
  };
  for (int i = 0; i < 100 && !next().ready; ++i) {}
  ASSERT_TRUE(next().ready);
  script.close();
  script = wire::connect_tcp("127.0.0.1", client.script_port, 1);
  const auto told = next();
  EXPECT_FALSE(told.ready);
  EXPECT_NE(told.not_ready.find("script"), std::string::npos) << told.not_ready;
  for (int i = 0; i < 100 && !next().ready; ++i) {}
  EXPECT_TRUE(next().ready);
}

// Whatever comes at the script's port: each cycle ends, and with it the lease, the stop and every age are looked at.
TEST(Rtde, AScriptThatTalksWithoutEndHoldsNoCycleUp) {
  hardware_sim::RtdeControllerOptions options;
  options.script_port = 1;  // its own script finds nobody
  hardware_sim::RtdeController simulated(options, read("ur5e.toml"));
  arm::ArmOptions client;
  client.port = simulated.port();
  client.script_port = wire::local_port(wire::listen_tcp("127.0.0.1", 0));
  const auto arm = arm::connect_rtde(client);
  const wire::Socket script = wire::connect_tcp("127.0.0.1", client.script_port, 1);
  std::atomic<bool> ending = false;
  std::vector<std::thread> talkers;
  for (int k = 0; k < 2; ++k)
    talkers.emplace_back([&] {
      const std::vector<std::uint8_t> words(1 << 16, 7);
      for (const double end_s = rig::host_now_s() + 4; !ending && rig::host_now_s() < end_s;)
        ::send(script.descriptor(), words.data(), words.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  double longest_s = 0;
  for (int i = 0; i < 50; ++i) {
    const double from_s = rig::host_now_s();
    arm->cycle(std::nullopt, 0.01);
    longest_s = std::max(longest_s, rig::host_now_s() - from_s);
  }
  ending = true;
  for (std::thread& talker : talkers) talker.join();
  EXPECT_LT(longest_s, 1);
}

INSTANTIATE_TEST_SUITE_P(Backends, ArmContract, testing::Values(Backend{"rtde", start_rtde}, Backend{"mxt", start_mxt}),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace selvedge
