// The bus over the real network stack, each test on a port of its own; multicast is set up where the host
// has none.
#include "rig/bus.h"

#include <chrono>
#include <cmath>
#include <thread>

#include <gtest/gtest.h>

#include "files/bad_input.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include "rig/network.h"
#include "selvedge_rig/corner_sample_t.hpp"
#include "selvedge_rig/device_status_t.hpp"
#include "tests/rig/raw_lcm.h"

namespace selvedge::rig {
namespace {

using selvedge_rig::corner_sample_t;
using selvedge_rig::device_status_t;

class BusTest : public ::testing::Test {
 protected:
  static BusConfiguration on_port(int port) {
    ensure_local_multicast(static_cast<uint16_t>(port));
    BusConfiguration configuration;
    configuration.port = port;
    return configuration;
  }
  // Handles until `done` or a long time-out, so that a slow machine only takes longer.
  template <class Done>
  static bool wait(Bus& bus, Done done) {
    for (const int64_t end = host_now_us() + 20'000'000; host_now_us() < end;) {
      if (done()) return true;
      bus.handle(0.02);
    }
    return done();
  }
  static corner_sample_t two_corners() {
    corner_sample_t sample{};
    sample.utime = host_now_us();
    sample.count = 2;
    sample.name = {"left", "right"};
    sample.x_m = {0.1, 0.2};
    sample.y_m = {0.3, 0.4};
    sample.z_m = {1.5, std::nan("")};
    sample.occluded = {0, 1};
    return sample;
  }
};

TEST_F(BusTest, CarriesAMessageWhole) {
  Bus sender(on_port(17101)), receiver(on_port(17101));
  corner_sample_t got{};
  receiver.subscribe<corner_sample_t>("TRACKER_CORNERS", [&](const corner_sample_t& sample) { got = sample; });
  corner_sample_t sent = two_corners();
  sender.publish("TRACKER_CORNERS", sent);
  ASSERT_TRUE(wait(receiver, [&] { return got.sequence == 1; }));
  EXPECT_EQ(got.name, sent.name);
  EXPECT_EQ(got.x_m, sent.x_m);
  EXPECT_TRUE(std::isnan(got.z_m[1]));
  EXPECT_EQ(got.occluded, sent.occluded);
  EXPECT_EQ(got.utime, sent.utime);
}

TEST_F(BusTest, CountsMissingSequenceNumbers) {
  Bus sender(on_port(17102)), receiver(on_port(17102));
  receiver.subscribe<corner_sample_t>("TRACKER_CORNERS", [](const corner_sample_t&) {});
  corner_sample_t sample = two_corners();
  for (const int64_t number : {1, 2, 5, 6, 10}) {
    sample.sequence = number;
    sender.publish_bytes("TRACKER_CORNERS", encoded(sample));
  }
  ASSERT_TRUE(wait(receiver, [&] { return receiver.count("TRACKER_CORNERS").received == 5; }));
  EXPECT_EQ(receiver.count("TRACKER_CORNERS").lost, 2 + 3);
  sample.sequence = 1;  // the publisher starts anew
  sender.publish_bytes("TRACKER_CORNERS", encoded(sample));
  ASSERT_TRUE(wait(receiver, [&] { return receiver.count("TRACKER_CORNERS").received == 6; }));
  EXPECT_EQ(receiver.count("TRACKER_CORNERS").lost, 5);
}

TEST_F(BusTest, CountsWhatComesAgain) {
  Bus sender(on_port(17107)), receiver(on_port(17107));
  receiver.subscribe<corner_sample_t>("TRACKER_CORNERS", [](const corner_sample_t&) {});
  corner_sample_t sample = two_corners();
  int64_t sent = 0;
  const auto send = [&](int64_t number) {
    sample.sequence = number;
    sender.publish_bytes("TRACKER_CORNERS", encoded(sample));
    ++sent;
  };
  for (const int64_t number : {1, 2, 3, 3, 2, 4}) send(number);
  ASSERT_TRUE(wait(receiver, [&] { return receiver.count("TRACKER_CORNERS").received == sent; }));
  EXPECT_EQ(receiver.count("TRACKER_CORNERS").repeated, 2);
  EXPECT_EQ(receiver.count("TRACKER_CORNERS").lost, 0);  // 4 follows 3, whatever came again in between
  for (const int64_t number : {1, 2}) send(number);      // a publisher that starts anew
  ASSERT_TRUE(wait(receiver, [&] { return receiver.count("TRACKER_CORNERS").received == sent; }));
  EXPECT_EQ(receiver.count("TRACKER_CORNERS").repeated, 2);
}

TEST_F(BusTest, LivesThroughHostileMessages) {
  Bus sender(on_port(17103)), receiver(on_port(17103));
  int handled = 0;
  receiver.subscribe<corner_sample_t>("TRACKER_CORNERS", [&](const corner_sample_t& sample) {
    ++handled;
    if (sample.frame_number == 13) throw std::runtime_error("the handler's own fault");
  });
  const std::vector<uint8_t> good = encoded(two_corners());
  const size_t count_at = 8 + 4 * 8 + 2 * 8;  // hash, four int64, two doubles
  int hostile = 0;
  // Sizes that are negative, enormous, or one too many; then every truncation; then a foreign type.
  for (const uint32_t size : {0xffffffffu, 0x80000000u, 0x7fffffffu, 0x00010000u, 3u}) {
    std::vector<uint8_t> bytes = good;
    for (size_t i = 0; i < 4; ++i) bytes[count_at + i] = static_cast<uint8_t>(size >> (24 - 8 * i));
    sender.publish_bytes("TRACKER_CORNERS", bytes), ++hostile;
  }
  for (const uint32_t length : {0u, 0xffffffffu, 0x80000000u, 0x7fffffffu}) {  // of the first name
    std::vector<uint8_t> bytes = good;
    for (size_t i = 0; i < 4; ++i) bytes[count_at + 4 + i] = static_cast<uint8_t>(length >> (24 - 8 * i));
    sender.publish_bytes("TRACKER_CORNERS", bytes), ++hostile;
  }
  for (size_t size = 1; size < good.size(); ++size)
    sender.publish_bytes("TRACKER_CORNERS", {good.begin(), good.begin() + static_cast<long>(size)}), ++hostile;
  device_status_t foreign{};
  sender.publish("TRACKER_CORNERS", foreign), ++hostile;
  ASSERT_TRUE(wait(receiver, [&] { return receiver.count("TRACKER_CORNERS").undecodable >= hostile; }))
      << receiver.count("TRACKER_CORNERS").undecodable << " of " << hostile;
  EXPECT_EQ(handled, 0);

  corner_sample_t bad_luck = two_corners();
  bad_luck.frame_number = 13;
  sender.publish("TRACKER_CORNERS", bad_luck);
  corner_sample_t sample = two_corners();
  sender.publish("TRACKER_CORNERS", sample);
  ASSERT_TRUE(wait(receiver, [&] { return receiver.count("TRACKER_CORNERS").received == 1; }));
  EXPECT_EQ(receiver.count("TRACKER_CORNERS").failed, 1);
}

TEST_F(BusTest, PortsIsolate) {
  Bus sender(on_port(17104)), stranger(on_port(17105)), receiver(on_port(17104));
  stranger.subscribe<corner_sample_t>("TRACKER_CORNERS", [](const corner_sample_t&) {});
  receiver.subscribe<corner_sample_t>("TRACKER_CORNERS", [](const corner_sample_t&) {});
  corner_sample_t sample = two_corners();
  sender.publish("TRACKER_CORNERS", sample);
  ASSERT_TRUE(wait(receiver, [&] { return receiver.count("TRACKER_CORNERS").received == 1; }));
  stranger.handle(0.05);
  EXPECT_EQ(stranger.count("TRACKER_CORNERS").received, 0);
}

TEST_F(BusTest, RunsHandlersOnItsOwnThread) {
  Bus sender(on_port(17106)), receiver(on_port(17106));
  std::atomic<int> handled{0};
  receiver.subscribe<corner_sample_t>("TRACKER_CORNERS", [&](const corner_sample_t&) { ++handled; });
  receiver.start();
  corner_sample_t sample = two_corners();
  for (int i = 0; i < 100; ++i) sender.publish("TRACKER_CORNERS", sample);
  for (const int64_t end = host_now_us() + 20'000'000; handled < 100 && host_now_us() < end;)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(handled, 100);
  EXPECT_EQ(receiver.count("TRACKER_CORNERS").lost, 0);
}

TEST(Channels, AreCapitals) { EXPECT_EQ(channel("camera", kStatus), "CAMERA_STATUS"); }

}  // namespace
}  // namespace selvedge::rig
