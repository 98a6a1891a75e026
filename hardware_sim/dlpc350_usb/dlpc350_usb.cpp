#include "hardware_sim/dlpc350_usb/dlpc350_usb.h"

#include <algorithm>
#include <atomic>

#include "hardware_sim/usb_bus/usb_device.h"
#include "rig/clock.h"

namespace selvedge::hardware_sim {

namespace {

constexpr uint8_t kReportsIn = 0x81;

// 0451:6401, one configuration, one HID interface, endpoints 0x01 out and 0x81 in of 64 bytes each millisecond.
const UsbIdentity kIdentity = {
    .number = 2,
    .speed_mbit = 12,
    .descriptors = {0x12, 0x01, 0x00, 0x02, 0x00, 0x00, 0x00, 0x40, 0x51, 0x04, 0x01, 0x64, 0x00, 0x01, 0x00,
                    0x00, 0x00, 0x01, 0x09, 0x02, 0x29, 0x00, 0x01, 0x01, 0x00, 0xC0, 0x32, 0x09, 0x04, 0x00,
                    0x00, 0x02, 0x03, 0x00, 0x00, 0x00, 0x09, 0x21, 0x11, 0x01, 0x00, 0x01, 0x22, 0x20, 0x00,
                    0x07, 0x05, 0x01, 0x03, 0x40, 0x00, 0x01, 0x07, 0x05, 0x81, 0x03, 0x40, 0x00, 0x01},
    .strings = {}};

}  // namespace

struct Dlpc350Usb::Plugged {
  explicit Plugged(const Dlpc350Options& options)
      : device(options), usb(kIdentity, [this](uint8_t, const UsbBytes& bytes) { on_report(bytes); }) {}

  void on_report(const UsbBytes& bytes) {
    projector::Report report;
    if (hangs || bytes.size() != report.size()) return;
    std::copy(bytes.begin(), bytes.end(), report.begin());
    for (const auto& reply : device.on_report(report, rig::host_now_s()))
      usb.send(kReportsIn, {reply.begin(), reply.end()});
  }

  Dlpc350Device device;
  std::atomic<bool> hangs = false;
  UsbDevice usb;  // last: its thread uses the others
};

Dlpc350Usb::Dlpc350Usb(const Dlpc350Options& options) : plugged_(std::make_unique<Plugged>(options)) { replug(); }
Dlpc350Usb::~Dlpc350Usb() = default;
Dlpc350Device& Dlpc350Usb::device() { return plugged_->device; }
void Dlpc350Usb::unplug() { plugged_->usb.unplug(); }
void Dlpc350Usb::hang() { plugged_->hangs = true; }
void Dlpc350Usb::replug() { plugged_->usb.plug_in(); }

}  // namespace selvedge::hardware_sim
