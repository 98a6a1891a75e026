// The simulated DLPC350 on an emulated USB bus (hardware_sim/usb_bus): one HID interface with an interrupt endpoint
// each way; reports of 64 bytes go to Dlpc350Device and back.
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
  struct Plugged;
  std::unique_ptr<Plugged> plugged_;
};

}  // namespace selvedge::hardware_sim
