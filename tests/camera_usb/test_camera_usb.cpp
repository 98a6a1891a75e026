// The camera's contract over USB3 Vision: the stock Aravis and libusb against a device on an emulated bus.
#include <gmock/gmock.h>

#include "hardware_sim/usb3_camera/usb3_camera.h"
#include "rig/bus.h"
#include "tests/camera/camera_contract.h"
#include "tests/camera/clients.h"
#include "tests/needs_package.h"

namespace selvedge::camera {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::shared_ptr<sim::Usb3Camera> plug_in(const sim::Usb3CameraOptions& options) {
  const size_t count = static_cast<size_t>(options.width_px) * static_cast<size_t>(options.height_px);
  return std::make_shared<sim::Usb3Camera>(options, [count](double time_s, uint8_t* pixels) {
    paint(time_s, pixels, count);
    return true;
  });
}

sim::Usb3CameraOptions small() {
  sim::Usb3CameraOptions options;
  options.width_px = 320;
  options.height_px = 240;
  options.clock_offset_s = 5;
  return options;
}

ContractDevice start_usb3() {
  const auto device = plug_in(small());
  return {.open = [device](const CameraConfiguration& c) { return open_aravis_camera(c); },
          .address = device->name(),
          .lose_frames = [device] { device->lose_next(3); },
          .unplug = [device] { device->unplug(); },
          .width_px = small().width_px,
          .height_px = small().height_px};
}

INSTANTIATE_TEST_SUITE_P(Backends, CameraContract, testing::Values(ContractBackend{"aravis_usb3", start_usb3}),
                         [](const auto& info) { return info.param.name; });

CameraConfiguration configuration_of(const sim::Usb3Camera& device) {
  CameraConfiguration configuration;
  configuration.address = device.name();
  configuration.rate_hz = 50;
  return configuration;
}

TEST(Usb3, AFrameThatEndsEarlyIsNotWholeAndTheNextOnesAre) {
  const auto device = plug_in(small());
  CameraConfiguration configuration = configuration_of(*device);
  configuration.rate_hz = 10;
  const auto camera = open_camera(configuration);
  camera->start();
  int spoiled = 0, whole_after = 0;
  int64_t last = 0;
  device->spoil_next(1);
  for (int i = 0; i < 30; ++i)
    ASSERT_TRUE(camera->next_frame(5, [&](const CameraFrame& frame) {
      spoiled += !frame.whole;
      whole_after += spoiled > 0 && frame.whole;
      EXPECT_GT(frame.number, last);
      last = frame.number;
    }));
  EXPECT_EQ(spoiled, 1);
  EXPECT_GT(whole_after, 20);
}

// 1.3 MB a frame: more than one payload transfer each.
TEST(Usb3, FramesLargerThanATransferComeWhole) {
  sim::Usb3CameraOptions options;
  options.width_px = 1280;
  options.height_px = 1024;
  const auto device = plug_in(options);
  CameraConfiguration configuration = configuration_of(*device);
  configuration.rate_hz = 10;
  const auto camera = open_camera(configuration);
  camera->start();
  for (int i = 0; i < 10; ++i)
    ASSERT_TRUE(camera->next_frame(20, [&](const CameraFrame& frame) {
      ASSERT_TRUE(frame.whole);
      EXPECT_FALSE(std::isnan(painted_time_s({frame.pixels, frame.pixels + 1280 * 1024})));
    }));
}

TEST(Usb3, TriggersExposeOnce) {
  const auto device = plug_in(small());
  CameraConfiguration configuration = configuration_of(*device);
  configuration.trigger = CameraTrigger::software;
  const auto camera = open_camera(configuration);
  camera->start();
  EXPECT_FALSE(camera->next_frame(0.3, [](const CameraFrame&) {}));
  for (int i = 1; i <= 3; ++i) {
    camera->software_trigger();
    ASSERT_TRUE(camera->next_frame(5, [&](const CameraFrame& frame) { EXPECT_EQ(frame.number, i); }));
  }
  camera->stop();
  camera->set_trigger(CameraTrigger::hardware);
  camera->start();
  device->trigger_edge(rig::host_now_s());
  ASSERT_TRUE(camera->next_frame(5, [&](const CameraFrame& frame) { EXPECT_EQ(frame.number, 1); }));
}

TEST(Usb3, ASecondClientIsToldThatTheDeviceIsTaken) {
  const auto device = plug_in(small());
  const auto camera = open_camera(configuration_of(*device));
  EXPECT_THROW(open_camera(configuration_of(*device)), CameraLost);
}

// The daemon finds the device again by its name: after a stalled stream, after silence, after a cable pulled and put
// back.
TEST(Usb3Daemon, GoesOnAfterWhateverStoppedTheDevice) {
  const auto device = plug_in(small());
  DaemonBench bench(61, device->name(), "rate_hz = 50\n");
  bench.start();
  const auto reader = bench.reader();
  ASSERT_TRUE(reader);
  RingFrame frame;
  int64_t last = 0;
  const auto twenty_frames = [&] {
    for (int i = 0; i < 20; ++i) {
      ASSERT_TRUE(reader->next(frame, 30)) << "after frame " << last;
      ASSERT_FALSE(std::isnan(painted_time_s(frame.pixels)));
      EXPECT_GT(frame.head.frame_number, last);
      last = frame.head.frame_number;
    }
  };
  twenty_frames();
  EXPECT_NEAR(static_cast<double>(frame.head.device_ticks -
                                  device->device_ticks(painted_time_s(frame.pixels) - 0.5 * frame.head.exposure_s)),
              0, 2000);
  device->halt_stream();
  twenty_frames();
  device->hang();
  std::this_thread::sleep_for(std::chrono::seconds(3));
  device->hang(false);
  twenty_frames();
  device->unplug();
  std::this_thread::sleep_for(std::chrono::seconds(1));
  device->replug();
  twenty_frames();
}

// Clients that are not ours, in processes of their own that see the same emulated bus.
TEST(SimulatedUsb3, ArvToolFindsItAndReadsAndWritesFeatures) {
  SELVEDGE_NEEDS(installed("arv-tool-0.8"), "aravis-tools-cli", "arv-tool on the simulated camera");
  const auto device = plug_in({});
  EXPECT_THAT(output("arv-tool-0.8"), HasSubstr(device->name()));
  const std::string tool = "arv-tool-0.8 -n " + device->name() + " control ";
  const std::string text = output(tool +
                                  "Width Height PixelFormat ExposureTime=5000 ExposureTime AcquisitionFrameRate=12.5 "
                                  "AcquisitionFrameRate DeviceModelName TimestampLatch TimestampLatchValue");
  EXPECT_THAT(text, AllOf(HasSubstr("Width = 640"), HasSubstr("Height = 480"), HasSubstr("PixelFormat = Mono8"),
                          HasSubstr("ExposureTime = 5000"), HasSubstr("AcquisitionFrameRate = 12.5"),
                          HasSubstr("Simulated USB3 camera")));
  EXPECT_NEAR(static_cast<double>(number_after(text, "TimestampLatchValue")),
              static_cast<double>(device->device_ticks(rig::host_now_s())), 10e9);
  EXPECT_THAT(output(tool + "Width=100"), HasSubstr("invalid-parameter"));
}

TEST(SimulatedUsb3, ArvCameraTestStreamsFromIt) {
  SELVEDGE_NEEDS(installed("arv-camera-test-0.8"), "aravis-tools", "arv-camera-test on the simulated camera");
  const auto device = plug_in({});
  const std::string text = output("timeout 60 arv-camera-test-0.8 -n " + device->name() + " --duration 2");
  EXPECT_GT(number_after(text, "n_completed_buffers"), 0) << text;  // how many is for `bench capture-usb3` to tell
  EXPECT_LE(number_after(text, "n_failures"), 1) << text;
}

}  // namespace
}  // namespace selvedge::camera
