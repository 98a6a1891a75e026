// The projector's contract over the socket that carries a DLPC350's reports, and its trigger line.
#include "tests/projector/projector_contract.h"

#include <unistd.h>

#include <mutex>

#include <fmt/format.h>

#include "hardware_sim/dlpc350/dlpc350_server.h"
#include "rig/clock.h"

namespace selvedge {
namespace {

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
          .shown = [server] { return picture_of(server->pattern_at(rig::host_now_s())); },
          .disconnect = [server] { server->disconnect(); },
          .reject_next = [server] { server->device().reject_next(1); },
          .hang = [server] { server->hang(5); }};
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
