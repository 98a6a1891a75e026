// What every camera back-end has to do, run over each of them beside its simulated device.
#pragma once

#include <functional>
#include <memory>
#include <cmath>
#include <limits>
#include <optional>
#include <ostream>
#include <string>

#include <gtest/gtest.h>

#include "files/bad_input.h"
#include "rig/camera/camera.h"
#include "tests/camera/bench.h"

namespace selvedge::camera {

// A simulated device and how to reach it.
struct ContractDevice {
  std::function<std::unique_ptr<Camera>(const CameraConfiguration&)> open;
  std::string address;
  std::function<void()> lose_frames;  // for a moment some frames do not arrive whole
  std::function<void()> unplug;
  int width_px = 0, height_px = 0;
};

struct ContractBackend {
  std::string name;
  std::function<ContractDevice()> start;
};
inline void PrintTo(const ContractBackend& backend, std::ostream* out) { *out << backend.name; }

class CameraContract : public testing::TestWithParam<ContractBackend> {
 protected:
  void SetUp() override {
    device_ = GetParam().start();
    configuration_.address = device_.address;
    configuration_.rate_hz = 50;
    configuration_.packet_size_bytes = 9000;
  }
  struct Shot {
    int64_t number, ticks, arrival_us;
    bool whole;
    double painted_s;  // NaN where a pixel is not what the device painted
  };
  static std::optional<Shot> shoot(Camera& camera, const CameraInformation& information) {
    std::optional<Shot> shot;
    for (const double end_s = rig::host_now_s() + 20; !shot && rig::host_now_s() < end_s;)
      camera.next_frame(0.5, [&](const CameraFrame& frame) {
        const size_t size = static_cast<size_t>(information.width_px) * static_cast<size_t>(information.height_px);
        shot = Shot{frame.number, frame.ticks, frame.arrival_us, frame.whole,
                    frame.whole ? painted_time_s({frame.pixels, frame.pixels + size})
                                : std::numeric_limits<double>::quiet_NaN()};
      });
    return shot;
  }
  // The next whole frame.
  static std::optional<Shot> shoot_whole(Camera& camera) {
    for (int i = 0; i < 100; ++i) {
      const auto shot = shoot(camera, camera.information());
      if (!shot || shot->whole) return shot;
    }
    return std::nullopt;
  }

  ContractDevice device_;
  CameraConfiguration configuration_;
};

TEST_P(CameraContract, FramesComeWholeInOrderAndSayWhenTheyWereTaken) {
  const auto camera = device_.open(configuration_);
  EXPECT_EQ(camera->information().width_px, device_.width_px);
  EXPECT_EQ(camera->information().height_px, device_.height_px);
  EXPECT_FALSE(camera->information().description.empty());
  camera->start();
  Shot last{};
  for (int i = 0; i < 50; ++i) {
    const auto shot = shoot_whole(*camera);
    ASSERT_TRUE(shot) << i;
    ASSERT_FALSE(std::isnan(shot->painted_s)) << "frame " << shot->number << " is not as the device painted it";
    EXPECT_GT(shot->number, last.number);
    EXPECT_GT(shot->ticks, last.ticks);
    EXPECT_GE(1e-6 * static_cast<double>(shot->arrival_us), shot->painted_s);
    last = *shot;
  }
  ClockReading reading;
  if (camera->read_clock(reading)) {
    // The reading tells what the host's clock was at the frame's ticks, its start of exposure.
    const double ticks_per_s = camera->information().ticks_per_s;
    const double since_s =
        static_cast<double>(reading.ticks - last.ticks) / ticks_per_s + 0.5 * configuration_.exposure_s;
    const double start_s = last.painted_s - configuration_.exposure_s;
    EXPECT_GE(1e-6 * static_cast<double>(reading.after_us) + 1e-3, start_s + since_s);
    EXPECT_LE(1e-6 * static_cast<double>(reading.before_us) - 1e-3, last.painted_s + since_s);
  }
  camera->stop();
}

TEST_P(CameraContract, StartsAgainAfterAStop) {
  const auto camera = device_.open(configuration_);
  for (int round = 0; round < 3; ++round) {
    camera->start();
    const auto first = shoot_whole(*camera), second = shoot_whole(*camera);
    ASSERT_TRUE(first && second) << round;
    EXPECT_GT(second->number, first->number);
    EXPECT_LT(first->number, 1000);
    camera->stop();
  }
}

TEST_P(CameraContract, LostFramesShow) {
  const auto camera = device_.open(configuration_);
  camera->start();
  const auto first = shoot_whole(*camera);
  ASSERT_TRUE(first);
  device_.lose_frames();
  int64_t last = first->number;
  bool shows = false;
  for (int i = 0; i < 400 && !shows; ++i) {
    const auto shot = shoot(*camera, camera->information());
    ASSERT_TRUE(shot);
    shows = !shot->whole || shot->number > last + 1;
    last = shot->number;
  }
  EXPECT_TRUE(shows);
}

TEST_P(CameraContract, WhatTheDeviceCannotDoIsRefused) {
  const auto camera = device_.open(configuration_);
  for (const double bad : {0.0, -1.0, 1e9, std::nan("")}) {
    EXPECT_THROW(camera->set_exposure(bad), BadInput) << bad;
    EXPECT_THROW(camera->set_rate(bad), BadInput) << bad;
  }
  EXPECT_NO_THROW(camera->set_exposure(0.004));
  EXPECT_NO_THROW(camera->set_rate(25));
  camera->start();
  EXPECT_TRUE(shoot_whole(*camera));
}

TEST_P(CameraContract, AnUnpluggedDeviceIsSaidToBeLostOrFallsSilent) {
  const auto camera = device_.open(configuration_);
  camera->start();
  ASSERT_TRUE(shoot_whole(*camera));
  device_.unplug();
  bool lost = false, silent = false;
  for (int i = 0; i < 1000 && !lost && !silent; ++i) {
    try {
      silent = !camera->next_frame(1, [](const CameraFrame&) {});
    } catch (const CameraLost&) { lost = true; }
  }
  EXPECT_TRUE(lost || silent);
}

TEST_P(CameraContract, NobodyThereIsSaid) {
  configuration_.address = device_.address + "9";
  EXPECT_THROW(device_.open(configuration_), CameraLost);
}

}  // namespace selvedge::camera
