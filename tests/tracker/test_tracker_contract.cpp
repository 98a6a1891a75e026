// What every corner tracker back-end has to do, run over each of them beside its simulated system.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <ostream>

#include "hardware_sim/datastream_server/datastream_server.h"
#include "hardware_sim/natnet_server/natnet_server.h"
#include "rig/clock.h"
#include "rig/tracker/tracker.h"
#include "rig/wire/bytes.h"
#include "rig/wire/socket.h"

namespace selvedge {
namespace {

// Left corner still, right corner on a sinusoid: a position says when it was taken.
std::vector<hardware_sim::NamedPoint> corners_at(double t) {
  return {{"fabric", "left", {-0.15, 0, 1.2}},
          {"fabric", "right", {0.15 + 0.06 * std::sin(2 * M_PI * t), 0.01, 1.2}},
          {"", "", {0.5, 0.5, 0.5}}};
}

struct Faults {
  double occlusions_per_s = 0;
  double drop_probability = 0;
};

// A simulated system and how to reach it.
struct System {
  std::function<std::unique_ptr<tracker::Tracker>()> connect;
  std::function<void()> cut;
  std::shared_ptr<void> server;
};

struct Backend {
  std::string name;
  std::function<System(const Faults&)> start;
};
void PrintTo(const Backend& backend, std::ostream* out) { *out << backend.name; }

System start_datastream(const Faults& faults) {
  hardware_sim::DatastreamServerOptions options;
  options.noise_m = 0;
  options.latency_s = 0.04;  // far above the bound below: a client that forgets it is found out
  options.occlusions_per_s = faults.occlusions_per_s;
  options.drop_probability = faults.drop_probability;
  auto server = std::make_shared<hardware_sim::DatastreamServer>(options, corners_at);
  tracker::TrackerOptions client;
  client.port = server->port();
  return {[client] { return tracker::connect_datastream(client); }, [server] { server->cut_connections(); }, server};
}

template <int major, int minor>
System start_natnet(const Faults& faults) {
  hardware_sim::NatnetServerOptions options;
  options.noise_m = 0;
  options.latency_s = 0.04;
  options.occlusions_per_s = faults.occlusions_per_s;
  options.drop_probability = faults.drop_probability;
  options.major = major;
  options.minor = minor;
  options.fill_hidden = minor == 1;
  auto server = std::make_shared<hardware_sim::NatnetServer>(options, corners_at);
  tracker::TrackerOptions client;
  client.port = server->port();
  client.connect_timeout_s = 10;
  return {[client] { return tracker::connect_natnet(client); }, [server] { server->fall_silent(4); }, server};
}

class TrackerContract : public testing::TestWithParam<Backend> {};

const tracker::TrackedMarker* find(const tracker::TrackerFrame& frame, const std::string& name) {
  for (const auto& marker : frame.markers)
    if (marker.name == name) return &marker;
  return nullptr;
}

TEST_P(TrackerContract, NamedMarkersArriveInMetresWithTheirCaptureTime) {
  const System system = GetParam().start({});
  const auto tracker = system.connect();
  // Rate and names may take a few frames to be known.
  for (int i = 0; i < 240; ++i)
    if (const auto frame = tracker->next(5); frame && frame->rate_hz > 0 && frame->markers.size() == 3) break;
  std::vector<double> lateness_s;
  std::int64_t last = 0;
  for (int i = 0; i < 60; ++i) {
    const auto frame = tracker->next(5);
    ASSERT_TRUE(frame);
    EXPECT_GT(frame->frame_number, last);
    last = frame->frame_number;
    EXPECT_NEAR(frame->rate_hz, 120, 0.01);
    const auto* left = find(*frame, "left");
    const auto* right = find(*frame, "right");
    ASSERT_TRUE(left && right);
    EXPECT_LT((left->position_m - Eigen::Vector3d(-0.15, 0, 1.2)).norm(), 1e-6);
    EXPECT_LE(std::abs(right->position_m.x() - 0.15), 0.0600001);
    EXPECT_TRUE(std::any_of(frame->markers.begin(), frame->markers.end(),
                            [](const auto& marker) { return marker.name.empty(); }));
    EXPECT_LE(frame->capture_s, frame->arrival_s);
    EXPECT_GE(frame->network_s, 0);
    EXPECT_LT(frame->network_s, 0.5);
    EXPECT_LE(frame->arrival_s, rig::host_now_s());
    // The rising side of the sinusoid gives the time back.
    const double phase = std::fmod(frame->capture_s, 1.0);
    if (phase < 0.15 || phase > 0.85) {
      const double true_phase = std::asin((right->position_m.x() - 0.15) / 0.06) / (2 * M_PI);
      lateness_s.push_back(std::remainder(phase - true_phase, 1.0));
    }
  }
  // Jitter and a busy machine only ever make a frame late, so the earliest one says whether the rule is right.
  if (!lateness_s.empty()) {
    const double earliest = *std::min_element(lateness_s.begin(), lateness_s.end());
    EXPECT_GT(earliest, -1e-4);
    EXPECT_LT(earliest, 0.02);
  }
}

TEST_P(TrackerContract, HiddenMarkerIsOccludedNotANumber) {
  const System system = GetParam().start({.occlusions_per_s = 10});
  const auto tracker = system.connect();
  int hidden = 0, seen = 0;
  for (int i = 0; i < 240 && (hidden == 0 || seen == 0); ++i) {
    const auto frame = tracker->next(5);
    ASSERT_TRUE(frame);
    for (const auto& marker : frame->markers) {
      EXPECT_EQ(marker.occluded, marker.position_m.hasNaN());
      (marker.occluded ? hidden : seen) += 1;
    }
  }
  EXPECT_GT(hidden, 0);
  EXPECT_GT(seen, 0);
}

TEST_P(TrackerContract, LostFrameShowsAsAGapInTheNumbers) {
  const System system = GetParam().start({.drop_probability = 0.2});
  const auto tracker = system.connect();
  std::int64_t last = -1, gaps = 0;
  for (int i = 0; i < 100; ++i) {
    const auto frame = tracker->next(5);
    ASSERT_TRUE(frame);
    if (last >= 0) gaps += frame->frame_number - last - 1;
    last = frame->frame_number;
  }
  EXPECT_GT(gaps, 0);
}

TEST_P(TrackerContract, CutConnectionIsSaidAndANewOneWorks) {
  const System system = GetParam().start({});
  const auto tracker = system.connect();
  ASSERT_TRUE(tracker->next(5));
  system.cut();
  EXPECT_ANY_THROW(for (int i = 0; i < 1000; ++i) tracker->next(0.1));
  const auto again = system.connect();
  EXPECT_TRUE(again->next(5));
}

TEST_P(TrackerContract, NobodyThereIsSaid) {
  System system = GetParam().start({});
  system.connect();
  auto connect = system.connect;
  system.cut = nullptr;
  system.server.reset();
  EXPECT_ANY_THROW({
    const auto tracker = connect();
    for (int i = 0; i < 100; ++i) tracker->next(0.1);
  });
}

INSTANTIATE_TEST_SUITE_P(Backends, TrackerContract,
                         testing::Values(Backend{"datastream", start_datastream},
                                         Backend{"natnet_3_0", start_natnet<3, 0>},
                                         Backend{"natnet_4_1", start_natnet<4, 1>}),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace selvedge
