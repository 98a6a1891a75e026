// The console's link where there is no rig, or half of one.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

#include "console/bus_rig_link.h"
#include "files/bad_input.h"
#include "rig/arm/control_server.h"
#include "rig/network.h"

namespace selvedge::console {
namespace {

// "Stopped" is said of an arm that was told so, and of a rig that is known to have none.
TEST(BusRigLink, AStopThatReachesNobodyIsNotConfirmed) {
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("selvedge-no-rig-{}", ::getpid());
  std::filesystem::create_directories(folder);
  BusRigLink link({folder / "rig.toml", folder / "calibration.json", folder});
  EXPECT_THROW(link.stop("test"), BadInput);
  std::ofstream(folder / "rig.toml") << "this is no TOML";
  EXPECT_THROW(link.stop("test"), BadInput);
  std::filesystem::remove_all(folder);
}

// The arm's daemon is away while somebody arms and then stops; it comes back while the arming still asks.
TEST(BusRigLink, AStopWaitsForNoArmingAndNoArmingOutlivesAStop) {
  ASSERT_TRUE(rig::multicast_works(20000 + ::getpid() % 20000)) << rig::multicast_advice();
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("selvedge-away-{}", ::getpid());
  std::filesystem::create_directories(folder);
  const auto socket = folder / "arm.socket";
  std::ofstream(folder / "rig.toml") << fmt::format(
      "[bus]\nport = {}\n[camera]\n[tracker]\n[projector]\n[arm]\nmodel = \"{}\"\ncontrol_socket = \"{}\"\n",
      20000 + ::getpid() % 20000, SELVEDGE_SOURCE_DIR "/data/arms/ur5e.toml", socket.string());
  BusRigLink link({folder / "rig.toml", folder / "calibration.json", folder});
  for (int i = 0; i < 400 && link.state()["rig"] != "listening"; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_EQ(link.state()["rig"], "listening");
  auto arming = std::async(std::launch::async, [&] { link.arm("test"); });
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  const auto asked = std::chrono::steady_clock::now();
  EXPECT_THROW(link.stop("test"), std::runtime_error);
  EXPECT_LT(std::chrono::steady_clock::now() - asked, std::chrono::seconds(2)) << "the stop waited for the arming";
  std::atomic<bool> ending = false, let_go = false;
  std::jthread daemon([&] {
    arm::ControlServer server(
        socket, {::geteuid()}, [](const std::string&) {}, [] { return ""; });
    while (!ending) {
      for (const auto& message : server.take()) {
        if (std::holds_alternative<arm::ControlServer::Closed>(message.what)) let_go = true;
        if (const auto* control = std::get_if<selvedge_rig::arm_control_t>(&message.what))
          server.answer(message.sender, control->sequence, "");
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  });
  EXPECT_THROW(arming.get(), std::runtime_error);
  for (int i = 0; i < 400 && !let_go; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_TRUE(let_go);
  EXPECT_FALSE(link.armed_here());
  ending = true;
  daemon.join();
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace selvedge::console
