// The camera's contract over Aravis: the stock library against the simulated GigE Vision device.
#include "tests/camera/camera_contract.h"

namespace selvedge::camera {
namespace {

ContractDevice start_gige() {
  sim::GigeCameraOptions options;
  options.address = "127.0.4.20";
  options.width_px = 320;
  options.height_px = 240;
  options.clock_offset_s = 5;
  const size_t count = 320 * 240;
  auto device = std::make_shared<sim::GigeCamera>(options, [count](double time_s, uint8_t* pixels) {
    paint(time_s, pixels, count);
    return true;
  });
  const auto fault = [device](sim::GigeCameraFaults faults) { device->set_faults(faults); };
  return {.open = [device](const CameraConfiguration& c) { return open_aravis_camera(c); },
          .address = options.address,
          .lose_frames = [fault] { fault({.stream_loss = 0.9}); },
          .unplug = [fault] { fault({.unplugged = true}); },
          .width_px = 320,
          .height_px = 240};
}

INSTANTIATE_TEST_SUITE_P(Backends, CameraContract, testing::Values(ContractBackend{"aravis", start_gige}),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace selvedge::camera
