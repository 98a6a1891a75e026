// The projector's contract over USB: libusb against an emulated bus.
#include "hardware_sim/dlpc350_usb/dlpc350_usb.h"
#include "rig/clock.h"
#include "tests/projector/projector_contract.h"

namespace selvedge {
namespace {

Device start_usb() {
  auto bus = std::make_shared<hardware_sim::Dlpc350Usb>(hardware_sim::Dlpc350Options{});
  projector::ProjectorOptions options;
  options.transport = "usb";
  options.reply_timeout_s = 0.5;
  return {.open =
              [options, bus] {
    bus->replug();
    return projector::open_dlpc350(options);
          },
          .shown = [bus] { return picture_of(bus->device().pattern_at(rig::host_now_s())); },
          .disconnect = [bus] { bus->unplug(); },
          .reject_next = [bus] { bus->device().reject_next(1); },
          .hang = [bus] { bus->hang(); }};
}

INSTANTIATE_TEST_SUITE_P(Transports, ProjectorContract, testing::Values(Backend{"usb", start_usb}),
                         [](const auto& info) { return info.param.name; });

TEST(UsbTransport, NoDeviceIsSaid) {
  projector::ProjectorOptions options;
  options.transport = "usb";
  EXPECT_THROW(projector::open_dlpc350(options), wire::Disconnected);
}

}  // namespace
}  // namespace selvedge
