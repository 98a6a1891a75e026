// What every projector back-end has to do, run over each of them beside its simulated device.
#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "files/bad_input.h"
#include "hardware_sim/dlpc350/dlpc350_server.h"
#include "rig/clock.h"
#include "rig/projector/projector.h"
#include "rig/wire/socket.h"

namespace selvedge {
namespace {

using projector::Pattern;
using projector::PatternKind;

// A simulated device: what it shows now, and how to reach and to disturb it.
struct Device {
  std::function<std::unique_ptr<projector::Projector>()> open;
  std::function<Pattern()> shown;
  std::function<void()> disconnect;
  std::function<void()> reject_next;
  std::function<void()> hang;
};

struct Backend {
  std::string name;
  std::function<Device()> start;
};

std::string socket_path() {
  static int count = 0;
  return fmt::format("/tmp/selvedge-dlpc350-{}-{}.sock", ::getpid(), ++count);
}

Device start_dlpc350() {
  const std::string path = socket_path();
  auto server = std::make_shared<hardware_sim::Dlpc350Server>(path, hardware_sim::Dlpc350Options{});
  projector::ProjectorOptions options;
  options.transport = "unix:" + path;
  options.reply_timeout_s = 0.5;
  return {.open = [options] { return projector::open_dlpc350(options); },
          .shown = [server] { return server->pattern_at(rig::host_now_s()); },
          .disconnect = [server] { server->disconnect(); },
          .reject_next = [server] { server->device().reject_next(1); },
          .hang = [server] { server->hang(5); }};
}

class ProjectorContract : public testing::TestWithParam<Backend> {};

TEST_P(ProjectorContract, ShowsWhatItIsToldOnceItReturns) {
  const Device device = GetParam().start();
  const auto projector = device.open();
  std::vector<Pattern> patterns{{.kind = PatternKind::solid},
                                {.kind = PatternKind::solid, .inverted = true},
                                {.kind = PatternKind::stripes, .period_px = 16},
                                {.kind = PatternKind::stripes, .period_px = 24, .inverted = true},
                                {}};
  for (int bit = 0; bit < 11; ++bit) patterns.push_back({.kind = PatternKind::gray_code, .bit = bit});
  for (int bit = 0; bit < 10; ++bit)
    patterns.push_back({.kind = PatternKind::gray_code, .orientation = projector::Orientation::vertical, .bit = bit,
                        .inverted = bit % 2 == 1});
  for (const auto& pattern : patterns) {
    projector->show(pattern);
    projector->check();
    const Pattern shown = device.shown();
    for (int column = 0; column < 912; column += 7)
      for (int row = 0; row < 1140; row += 5)
        ASSERT_EQ(projector::brightness(shown, column, row), projector::brightness(pattern, column, row))
            << "kind " << static_cast<int>(pattern.kind) << " bit " << pattern.bit << " at " << column << ", " << row;
  }
}

TEST_P(ProjectorContract, PatternItCannotShowIsRefusedAndNothingChanges) {
  const Device device = GetParam().start();
  const auto projector = device.open();
  const Pattern stripes{.kind = PatternKind::stripes, .period_px = 16};
  projector->show(stripes);
  EXPECT_THROW(projector->show({.kind = PatternKind::stripes, .period_px = 16.5}), BadInput);
  EXPECT_EQ(device.shown(), stripes);
}

TEST_P(ProjectorContract, RejectedCommandIsAFaultAndTheNextOneWorks) {
  const Device device = GetParam().start();
  const auto projector = device.open();
  device.reject_next();
  EXPECT_THROW(projector->show({.kind = PatternKind::solid}), projector::ProjectorFault);
  projector->show({.kind = PatternKind::solid});
  EXPECT_EQ(device.shown().kind, PatternKind::solid);
}

TEST_P(ProjectorContract, PulledPlugIsSaidAndANewConnectionWorks) {
  const Device device = GetParam().start();
  auto projector = device.open();
  projector->show({.kind = PatternKind::solid});
  device.disconnect();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_THROW(projector->check(), wire::Disconnected);
  projector.reset();
  projector = device.open();
  projector->show({.kind = PatternKind::solid});
  EXPECT_EQ(device.shown().kind, PatternKind::solid);
}

TEST_P(ProjectorContract, SilentDeviceIsSaidInTime) {
  const Device device = GetParam().start();
  const auto projector = device.open();
  device.hang();
  EXPECT_THROW(projector->check(), wire::Disconnected);
}

INSTANTIATE_TEST_SUITE_P(Backends, ProjectorContract, testing::Values(Backend{"dlpc350", start_dlpc350}),
                         [](const auto& info) { return info.param.name; });

TEST(Dlpc350, TriggerPulsesOnceAShowing) {
  std::mutex mutex;
  std::vector<hardware_sim::TriggerEdge> edges;
  const std::string path = socket_path();
  hardware_sim::Dlpc350Server server(path, {}, [&](const hardware_sim::TriggerEdge& edge) {
    const std::lock_guard lock(mutex);
    edges.push_back(edge);
  });
  projector::ProjectorOptions options;
  options.transport = "unix:" + path;
  options.exposure_s = 0.01;
  const auto projector = projector::open_dlpc350(options);
  projector->show({.kind = PatternKind::solid});
  {
    const std::lock_guard lock(mutex);
    EXPECT_TRUE(edges.empty());  // no sequence, no pulse
  }
  projector->show({.kind = PatternKind::stripes, .period_px = 16});
  for (int i = 0; i < 1000; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const std::lock_guard lock(mutex);
    if (edges.size() >= 40) break;
  }
  projector->show({});
  const std::lock_guard lock(mutex);
  ASSERT_GE(edges.size(), 40u);
  for (size_t i = 0; i < edges.size(); ++i) EXPECT_EQ(edges[i].rising, i % 2 == 0);
  for (size_t i = 2; i < edges.size(); i += 2) EXPECT_NEAR(edges[i].host_time_s - edges[i - 2].host_time_s, 0.01, 1e-9);
}

}  // namespace
}  // namespace selvedge
