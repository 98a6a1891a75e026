#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "files/bad_input.h"
#include "rig/camera/camera.h"
#include "rig/channels.h"
#include "rig/clock_message.h"
#include "selvedge_rig/camera_command_t.hpp"
#include "selvedge_rig/device_status_t.hpp"
#include "selvedge_rig/frame_stamp_t.hpp"
#include "selvedge_rig/preview_t.hpp"
#include "tests/camera/bench.h"

namespace selvedge::camera {
namespace {

using selvedge_rig::camera_command_t;
using selvedge_rig::device_status_t;
using selvedge_rig::frame_stamp_t;

// Runs the bus until `done`, at most half a minute.
template <class Done>
bool wait(rig::Bus& bus, Done done) {
  for (const double end_s = rig::host_now_s() + 30; rig::host_now_s() < end_s;) {
    if (done()) return true;
    bus.handle(0.02);
  }
  return done();
}

sim::GigeCameraOptions skewed_clock() {
  sim::GigeCameraOptions options;
  options.clock_offset_s = 5;
  options.clock_drift_ppm = 50;
  return options;
}

TEST(CameraDaemon, FramesArriveWholeAndInOrderUnderLoss) {
  Bench bench(1);
  sim::GigeCameraFaults faults;
  faults.stream_loss = 0.01;
  bench.device->set_faults(faults);
  bench.start();
  const auto reader = bench.reader();
  ASSERT_TRUE(reader);
  RingFrame frame;
  int64_t frames = 0, first = 0, last = 0;
  double last_time_s = 0;
  while (frames < 200) {
    ASSERT_TRUE(reader->next(frame, 20)) << "after " << frames << " frames";
    const double time_s = painted_time_s(frame.pixels);
    ASSERT_FALSE(std::isnan(time_s)) << "frame " << frame.head.frame_number << " is not as the camera sent it";
    ASSERT_GT(frame.head.frame_number, last);
    ASSERT_GT(time_s, last_time_s);
    last = frame.head.frame_number;
    last_time_s = time_s;
    if (first == 0) first = last;
    ++frames;
  }
  const auto counts = bench.device->counts();
  EXPECT_GT(counts.packets_lost, 20);
  EXPECT_GT(counts.packets_resent, 20);
  EXPECT_EQ(reader->missed(), 0);
  // With resends a frame is lost only where the machine stalls for as long as a frame is kept.
  EXPECT_LE(last - first + 1 - frames, frames / 20);
}

TEST(CameraDaemon, MapsAClockThatIsOffAndDrifts) {
  Bench bench(2, skewed_clock());
  bench.start();
  const auto reader = bench.reader();
  ASSERT_TRUE(reader);
  RingFrame frame;
  // The map gets better with each reading of the device's clock.
  double error_s = 1, uncertainty_s = 1;
  for (const double end_s = rig::host_now_s() + 25; rig::host_now_s() < end_s && std::abs(error_s) > 1e-4;) {
    for (int i = 0; i < 50; ++i) {
      ASSERT_TRUE(reader->next(frame, 20));
      error_s = static_cast<double>(frame.head.utime) * 1e-6 - painted_time_s(frame.pixels);
      uncertainty_s = frame.head.uncertainty_s;
    }
  }
  EXPECT_LE(std::abs(error_s), 1e-4);
  EXPECT_LE(uncertainty_s, 1e-3);
  // Device ticks are the start of the exposure on the device's own clock.
  const double start_s = painted_time_s(frame.pixels) - 0.5 * frame.head.exposure_s;
  EXPECT_NEAR(static_cast<double>(frame.head.device_ticks - bench.device->device_ticks(start_s)), 0, 2000);
}

TEST(CameraDaemon, SpeaksOnTheBus) {
  Bench bench(3, skewed_clock());
  rig::Bus bus(bench.bus());
  device_status_t status{};
  frame_stamp_t stamp{};
  selvedge_rig::preview_t preview{};
  selvedge_rig::clock_map_t clock{};
  bus.subscribe<device_status_t>("CAMERA_STATUS", [&](const device_status_t& message) { status = message; });
  bus.subscribe<frame_stamp_t>("CAMERA_STAMP", [&](const frame_stamp_t& message) { stamp = message; });
  bus.subscribe<selvedge_rig::preview_t>("CAMERA_PREVIEW", [&](const auto& message) { preview = message; });
  bus.subscribe<selvedge_rig::clock_map_t>("CAMERA_CLOCK", [&](const auto& message) { clock = message; });
  bench.start();
  ASSERT_TRUE(wait(bus, [&] {
    return status.delivered >= 50 && status.has_temperature && stamp.whole && preview.size > 0 && clock.samples >= 50;
  }));
  EXPECT_EQ(status.state, device_status_t::RUNNING);
  EXPECT_EQ(status.device, "camera");
  EXPECT_GT(status.rate_hz, 0);
  EXPECT_NEAR(status.temperature_degc, bench.options.temperature_degc, 1e-9);
  EXPECT_GT(stamp.ring_slot_number, 0);
  EXPECT_GE(stamp.arrival_utime, stamp.utime - 1000);
  EXPECT_EQ(preview.width, 160);
  EXPECT_EQ(preview.height, 120);
  EXPECT_EQ(static_cast<int>(preview.grey.size()), preview.size);
  // The map alone turns the stamp's ticks into host time.
  const int64_t start_us = rig::from_message(clock).host_us(stamp.device_ticks);
  EXPECT_NEAR(static_cast<double>(start_us), static_cast<double>(stamp.utime) - 0.5e6 * stamp.exposure_s, 2000);
  EXPECT_EQ(bus.count("CAMERA_STAMP").lost, 0);
}

TEST(CameraDaemon, FollowsTheMasterOfItsNetwork) {
  sim::GigeCameraOptions options = skewed_clock();
  options.ptp_master_offset_s = 37.25;
  Bench bench(12, options, "rate_hz = 50\nptp = true\n");
  bench.start();
  const auto reader = bench.reader();
  ASSERT_TRUE(reader);
  RingFrame frame;
  double error_s = 1;
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(reader->next(frame, 20));
    const double start_s = painted_time_s(frame.pixels) - 0.5 * frame.head.exposure_s;
    // No frame, not even the first, bears a tick from before the step to the master's clock.
    EXPECT_NEAR(1e-9 * static_cast<double>(frame.head.device_ticks) - start_s, 37.25, 1e-5);
    error_s = static_cast<double>(frame.head.utime) * 1e-6 - painted_time_s(frame.pixels);
  }
  EXPECT_LE(std::abs(error_s), 2e-3);
}

TEST(CameraDaemon, CountsACameraAsLostThatFollowsNoMaster) {
  Bench bench(13, {}, "rate_hz = 50\nptp = true\n");
  rig::Bus bus(bench.bus());
  device_status_t status{};
  bus.subscribe<device_status_t>("CAMERA_STATUS", [&](const device_status_t& message) { status = message; });
  bench.start();
  ASSERT_TRUE(wait(bus, [&] { return status.state == device_status_t::LOST; }));
  EXPECT_THAT(status.message, ::testing::HasSubstr("ptp: Listening, expected Slave"));
}

TEST(CameraDaemon, RefusesToFollowAMasterWithoutTheFeature) {
  sim::GigeCameraOptions options;
  options.has_ptp = false;
  Bench bench(14, options, "rate_hz = 50\nptp = true\n");
  try {
    run_daemon(rig::Configuration::parse(bench.text, "bench.toml"), bench.stopping);
    FAIL() << "not refused";
  } catch (const BadInput& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("ptp: found a device without IEEE 1588"));
  }
}

TEST(CameraDaemon, TakesAFrameForEachTriggerAlone) {
  Bench bench(4, {}, "trigger = \"software\"\n");
  rig::Bus bus(bench.bus());
  std::vector<frame_stamp_t> stamps;
  device_status_t status{};
  bus.subscribe<device_status_t>("CAMERA_STATUS", [&](const device_status_t& message) { status = message; });
  bus.subscribe<frame_stamp_t>("CAMERA_STAMP", [&](const frame_stamp_t& stamp) { stamps.push_back(stamp); });
  bench.start();
  ASSERT_TRUE(wait(bus, [&] { return bench.device->streaming() && status.sequence > 0; }));
  bus.handle(0.2);
  EXPECT_TRUE(stamps.empty());
  camera_command_t command{};
  command.action = camera_command_t::SOFTWARE_TRIGGER;
  for (size_t shot = 1; shot <= 5; ++shot) {
    command.utime = rig::host_now_us();
    bus.publish("CAMERA_COMMAND", command);
    ASSERT_TRUE(wait(bus, [&] { return stamps.size() >= shot; })) << shot;
  }
  EXPECT_EQ(stamps.size(), 5u);
  EXPECT_EQ(stamps.back().frame_number - stamps.front().frame_number, 4);

  // The projector's edge, once the line is selected.
  command.action = camera_command_t::SET;
  command.trigger = camera_command_t::TRIGGER_HARDWARE;
  command.exposure_s = 0.004;
  bus.publish("CAMERA_COMMAND", command);
  double edge_s = 0;
  ASSERT_TRUE(wait(bus, [&] {
    edge_s = rig::host_now_s();
    bench.device->trigger_edge(edge_s);
    return stamps.size() >= 7;
  }));
  EXPECT_EQ(stamps.back().exposure_s, 0.004);
}

TEST(CameraDaemon, LivesThroughHostileCommands) {
  Bench bench(5);
  rig::Bus bus(bench.bus());
  device_status_t status{};
  bus.subscribe<device_status_t>("CAMERA_STATUS", [&](const device_status_t& message) { status = message; });
  bench.start();
  ASSERT_TRUE(wait(bus, [&] { return status.delivered > 10; }));
  for (size_t size : {0u, 1u, 7u, 8u, 20u, 60000u})
    bus.publish_bytes("CAMERA_COMMAND", std::vector<uint8_t>(size, 0xff));
  camera_command_t command{};
  command.action = 77;
  bus.publish("CAMERA_COMMAND", command);
  command.action = camera_command_t::SET;
  command.exposure_s = std::nan("");
  bus.publish("CAMERA_COMMAND", command);
  command.exposure_s = -3;
  bus.publish("CAMERA_COMMAND", command);
  command.exposure_s = 0;
  command.rate_hz = 1e300;
  bus.publish("CAMERA_COMMAND", command);
  command.rate_hz = 0;
  command.trigger = -5;
  bus.publish("CAMERA_COMMAND", command);
  ASSERT_TRUE(wait(bus, [&] { return status.refused >= 11; })) << status.refused;
  const int64_t before = status.delivered;
  EXPECT_TRUE(wait(bus, [&] { return status.delivered > before + 20; }));
  EXPECT_EQ(status.state, device_status_t::RUNNING);
}

TEST(CameraDaemon, OpensALostCameraAnewAndShowsTheHole) {
  Bench bench(6, {}, "rate_hz = 50\nlost_after_s = 0.5\n");
  rig::Bus bus(bench.bus());
  device_status_t status{};
  bool was_lost = false;
  bus.subscribe<device_status_t>("CAMERA_STATUS", [&](const device_status_t& message) {
    status = message;
    was_lost |= message.state == device_status_t::LOST;
  });
  std::vector<int64_t> numbers;
  bus.subscribe<frame_stamp_t>("CAMERA_STAMP",
                               [&](const frame_stamp_t& stamp) { numbers.push_back(stamp.frame_number); });
  bench.start();
  ASSERT_TRUE(wait(bus, [&] { return status.delivered > 20; }));
  bench.device.reset();
  ASSERT_TRUE(wait(bus, [&] { return was_lost; }));
  bench.plug_in();
  const int64_t before = status.delivered;
  ASSERT_TRUE(wait(bus, [&] { return status.delivered > before + 20; }));
  EXPECT_EQ(status.state, device_status_t::RUNNING);
  EXPECT_GE(status.drops, 1);
  int steps = 0;
  for (size_t i = 1; i < numbers.size(); ++i) {
    EXPECT_GT(numbers[i], numbers[i - 1]);
    steps += numbers[i] > numbers[i - 1] + 1;
  }
  EXPECT_GE(steps, 1);
}

TEST(CameraConfiguration, IsChecked) {
  const auto read = [](const std::string& keys) {
    return read_configuration(rig::Configuration::parse("[camera]\n" + keys, "rig.toml").section("camera"));
  };
  EXPECT_EQ(read("address = \"10.0.0.2\"\nrate_hz = 30\n").rate_hz, 30);
  for (const char* bad : {"", "address = 3\n", "address = \"a\"\nrate_hz = 0\n", "address = \"a\"\nbackend = \"x\"\n",
                          "address = \"a\"\nexposre_s = 1\n", "address = \"a\"\nrate_hz = 100\nexposure_s = 0.02\n",
                          "address = \"a\"\ntrigger = \"line\"\n"})
    EXPECT_THROW(read(bad), BadInput) << bad;
}

TEST(CameraDaemon, SaysThatNobodyAnswers) {
  CameraConfiguration configuration;
  configuration.address = "127.0.3.200";
  EXPECT_THROW(open_camera(configuration), CameraLost);
}

}  // namespace
}  // namespace selvedge::camera
