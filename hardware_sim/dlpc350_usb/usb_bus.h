// The simulated DLPC350 on an emulated USB bus, at the level at which the kernel's usbfs meets libusb (umockdev).
//
// The process must run under umockdev-wrapper. One HID interface with an interrupt endpoint each way; reports of
// 64 bytes go to Dlpc350Device and back. URBs of an endpoint complete strictly in their order, and a reap with
// nothing to fetch takes a millisecond, or libusb would spin.
#pragma once

#include <memory>

#include "hardware_sim/dlpc350/device.h"

namespace selvedge::hardware_sim {

class Dlpc350Usb {
 public:
  // Throws std::runtime_error outside umockdev-wrapper.
  explicit Dlpc350Usb(const Dlpc350Options& options);
  ~Dlpc350Usb();

  Dlpc350Device& device();
  // The device stops answering; every transfer fails from now on until replug().
  void unplug();
  void replug();
  // Takes reports and answers none of them any more.
  void hang();

 private:
  class Bus;
  std::unique_ptr<Bus> bus_;
};

}  // namespace selvedge::hardware_sim
