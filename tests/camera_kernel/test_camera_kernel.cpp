// The V4L2 camera on the kernel's own test driver, vivid, which streams through the real videobuf2 and injects real
// errors.
//
// SELVEDGE_VIVID_NODE names the node; run.sh sets it in the virtual machine. vivid's controls are found by their names.
// Source: The Linux Kernel, "The Virtual Video Test Driver (vivid)", chapters "Error Injection Controls" and "Webcam
// Input".
#include <gtest/gtest.h>

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <thread>
#include <vector>

#include "files/bad_input.h"
#include "rig/camera/camera.h"
#include "rig/clock.h"

namespace selvedge::camera {
namespace {

class Vivid : public testing::Test {
 protected:
  void SetUp() override {
    const char* node = std::getenv("SELVEDGE_VIVID_NODE");
    if (node == nullptr)
      GTEST_SKIP() << "SKIPPED: the camera was NOT tried on a real kernel driver; ./selvedge test --kernel does";
    configuration_.backend = "v4l2";
    configuration_.address = node;
    configuration_.rate_hz = 30;
    configuration_.buffers = 4;
  }

  // Sets the control of that name; a button is pressed.
  void set_control(const std::string& name, int value) const {
    const int node = ::open(configuration_.address.c_str(), O_RDWR);
    ASSERT_GE(node, 0) << std::strerror(errno);
    v4l2_queryctrl query{};
    query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    bool found = false;
    for (; !found && ::ioctl(node, VIDIOC_QUERYCTRL, &query) == 0; query.id |= V4L2_CTRL_FLAG_NEXT_CTRL) {
      if (name != reinterpret_cast<const char*>(query.name)) continue;
      v4l2_control control{query.id, value};
      EXPECT_EQ(::ioctl(node, VIDIOC_S_CTRL, &control), 0) << name << ": " << std::strerror(errno);
      found = true;
    }
    ::close(node);
    EXPECT_TRUE(found) << "vivid has no control " << name;
  }

  struct Shot {
    int64_t number, ticks, arrival_us;
    bool whole;
    int least, most;  // grey levels
  };
  std::optional<Shot> shoot(Camera& camera) const {
    std::optional<Shot> shot;
    const CameraInformation& size = camera.information();
    camera.next_frame(5, [&](const CameraFrame& f) {
      shot = Shot{f.number, f.ticks, f.arrival_us, f.whole, 255, 0};
      for (size_t i = 0; i < static_cast<size_t>(size.width_px) * static_cast<size_t>(size.height_px); ++i) {
        shot->least = std::min<int>(shot->least, f.pixels[i]);
        shot->most = std::max<int>(shot->most, f.pixels[i]);
      }
    });
    return shot;
  }

  CameraConfiguration configuration_;
};

TEST_F(Vivid, StreamsWholeFramesInOrderWithTheDriversStamps) {
  const auto camera = open_camera(configuration_);
  EXPECT_NE(camera->information().description.find("vivid"), std::string::npos) << camera->information().description;
  set_control("Timestamp Source", 1);  // start of the frame: vivid's stamps of the end lie 0.9 of a period ahead
  camera->start();
  std::vector<Shot> shots;
  for (int i = 0; i < 90; ++i) {
    const auto shot = shoot(*camera);
    ASSERT_TRUE(shot) << i;
    EXPECT_TRUE(shot->whole);
    EXPECT_LT(shot->least, 40);  // vivid's bars of 75 %
    EXPECT_GT(shot->most, 150);
    EXPECT_LE(shot->ticks / 1000, shot->arrival_us);
    if (!shots.empty()) {
      EXPECT_GT(shot->number, shots.back().number);
      EXPECT_GT(shot->ticks, shots.back().ticks);
    }
    shots.push_back(*shot);
  }
  const double period_s = 1e-9 * static_cast<double>(shots.back().ticks - shots.front().ticks) /
                          static_cast<double>(shots.back().number - shots.front().number);
  EXPECT_NEAR(period_s, 1 / configuration_.rate_hz, 0.02 / configuration_.rate_hz);
}

TEST_F(Vivid, FramesThatFoundNoBufferAreAStepInTheNumbers) {
  const auto camera = open_camera(configuration_);
  camera->start();
  const auto before = shoot(*camera);
  ASSERT_TRUE(before);
  std::this_thread::sleep_for(std::chrono::seconds(1));  // 30 frames, four buffers
  std::optional<Shot> last;
  for (int i = 0; i < 10; ++i) last = shoot(*camera);
  ASSERT_TRUE(last);
  EXPECT_GT(last->number - before->number, 10 + 15);
}

TEST_F(Vivid, DroppedBuffersAreAStepInTheNumbers) {
  const auto camera = open_camera(configuration_);
  camera->start();
  const auto first = shoot(*camera);
  set_control("Percentage of Dropped Buffers", 20);
  std::optional<Shot> last;
  for (int i = 0; i < 100; ++i) last = shoot(*camera);
  set_control("Percentage of Dropped Buffers", 0);
  ASSERT_TRUE(first && last);
  EXPECT_GT(last->number - first->number, 105);
}

TEST_F(Vivid, AFrameWithTheErrorFlagIsNotWhole) {
  const auto camera = open_camera(configuration_);
  camera->start();
  ASSERT_TRUE(shoot(*camera));
  set_control("Inject V4L2_BUF_FLAG_ERROR", 1);
  int spoiled = 0;
  for (int i = 0; i < 30; ++i) {
    const auto shot = shoot(*camera);
    ASSERT_TRUE(shot) << i;
    spoiled += !shot->whole;
  }
  EXPECT_EQ(spoiled, 1);
}

TEST_F(Vivid, ARateThatTheDriverHasNotIsRefused) {
  configuration_.rate_hz = 7777;
  EXPECT_THROW(open_camera(configuration_), BadInput);
}

// Last: it ends the device until the driver is loaded again.
TEST_F(Vivid, ZUnpluggedIsSaid) {
  const auto camera = open_camera(configuration_);
  camera->start();
  ASSERT_TRUE(shoot(*camera));
  set_control("Disconnect", 1);
  EXPECT_THROW(
      {
        for (int i = 0; i < 20; ++i) camera->next_frame(0.5, [](const CameraFrame&) {});
      },
      CameraLost);
}

}  // namespace
}  // namespace selvedge::camera
