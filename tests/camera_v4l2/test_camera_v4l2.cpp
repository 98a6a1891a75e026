// The camera's contract over V4L2: the system calls of streaming against an emulated device node.
#include <cstdio>
#include <cstdlib>

#include "hardware_sim/v4l2_camera/v4l2_camera.h"
#include "tests/camera/camera_contract.h"
#include "tests/needs_package.h"

namespace selvedge::camera {
namespace {

std::shared_ptr<hardware_sim::V4l2Camera> plug_in(const hardware_sim::V4l2CameraOptions& options) {
  const size_t count = static_cast<size_t>(options.width_px) * static_cast<size_t>(options.height_px);
  return std::make_shared<hardware_sim::V4l2Camera>(
      options, [count](double time_s, uint8_t* pixels) { paint(time_s, pixels, count); });
}

template <bool stamps_end_of_frame>
ContractDevice start_v4l2() {
  const hardware_sim::V4l2CameraOptions options{.stamps_end_of_frame = stamps_end_of_frame};
  auto device = plug_in(options);
  return {.open = [device](const CameraConfiguration& c) { return open_v4l2_camera(c); },
          .address = options.node,
          .lose_frames = [device] { device->drop_next(2); },
          .unplug = [device] { device->unplug(); },
          .width_px = options.width_px,
          .height_px = options.height_px};
}

INSTANTIATE_TEST_SUITE_P(Backends, CameraContract,
                         testing::Values(ContractBackend{"v4l2", start_v4l2<false>},
                                         ContractBackend{"v4l2_end_of_frame", start_v4l2<true>}),
                         [](const auto& info) { return info.param.name; });

CameraConfiguration at_node() {
  CameraConfiguration configuration;
  configuration.backend = "v4l2";
  configuration.address = hardware_sim::V4l2CameraOptions().node;
  return configuration;
}

TEST(V4l2, AFrameWithTheErrorFlagIsNotWholeAndIsCounted) {
  const auto device = plug_in({});
  const auto camera = open_camera(at_node());
  camera->start();
  device->spoil_next(1);
  int spoiled = 0;
  int64_t last = 0;
  for (int i = 0; i < 30; ++i)
    camera->next_frame(5, [&](const CameraFrame& frame) {
      spoiled += !frame.whole;
      if (last > 0) { EXPECT_EQ(frame.number, last + 1); }
      last = frame.number;
    });
  EXPECT_EQ(spoiled, 1);
}

TEST(V4l2, ADroppedFrameIsAStepInTheNumbers) {
  const auto device = plug_in({});
  const auto camera = open_camera(at_node());
  camera->start();
  int64_t last = 0, largest = 0;
  for (int i = 0; i < 40; ++i) {
    if (i == 5) device->drop_next(3);
    camera->next_frame(5, [&](const CameraFrame& frame) {
      if (last > 0) largest = std::max(largest, frame.number - last);
      last = frame.number;
    });
  }
  EXPECT_GE(largest, 4);
}

TEST(V4l2, StampsOfTheEndOfTheFrameLeaveTheReadOutOpen) {
  hardware_sim::V4l2CameraOptions options;
  for (const bool end : {false, true}) {
    options.stamps_end_of_frame = end;
    const auto device = plug_in(options);
    CameraConfiguration configuration = at_node();
    configuration.minimum_delay_sd_s = 0.001;
    const auto camera = open_camera(configuration);
    camera->start();
    ASSERT_TRUE(camera->next_frame(5, [](const CameraFrame&) {}));
    EXPECT_EQ(camera->information().stamp_sd_s, end ? 0.001 : 0.0);
  }
}

// A client that is not ours, in a process of its own that sees the same emulated node.
TEST(SimulatedV4l2, V4l2CtlStreamsFromIt) {
  SELVEDGE_NEEDS(std::system("command -v v4l2-ctl > /dev/null 2>&1") == 0, "v4l-utils",
                 "v4l2-ctl on the simulated camera");
  const auto device = plug_in({});
  FILE* pipe = ::popen("timeout 60 v4l2-ctl -d /dev/video0 --stream-mmap --stream-count=30 --verbose 2>&1", "r");
  std::string text;
  for (char part[4096]; std::fgets(part, sizeof part, pipe);) text += part;
  EXPECT_EQ(::pclose(pipe), 0) << text;
  EXPECT_NE(text.find("seq:     29"), std::string::npos) << text;
  EXPECT_EQ(text.find("dropped"), std::string::npos) << text;
}

TEST(V4l2, TriggersAreRefused) {
  const auto device = plug_in({});
  CameraConfiguration configuration = at_node();
  configuration.trigger = CameraTrigger::hardware;
  EXPECT_THROW(open_camera(configuration), BadInput);
}

}  // namespace
}  // namespace selvedge::camera
