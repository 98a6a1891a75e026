// A device on an emulated USB bus, at the level at which the kernel's usbfs meets libusb (umockdev).
//
// The process must run under umockdev-wrapper; its children see the bus too. Bulk and interrupt endpoints carry
// transfers: what one send() hands over ends with a short packet, so a longer read ends there and a shorter one
// leaves the rest to the next. URBs of an endpoint complete strictly in their order, an interface belongs to the
// client that claimed it, and what a client leaves behind goes with it. A reap with nothing to fetch waits up to a
// millisecond, or libusb would spin.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace selvedge::hardware_sim {

using UsbBytes = std::vector<uint8_t>;

struct UsbIdentity {
  int number = 2;  // on bus 1: /dev/bus/usb/001/00N; 1 is the hub
  int speed_mbit = 12;
  UsbBytes descriptors;              // device descriptor, then the configuration's, as the wire has them
  std::vector<std::string> strings;  // string descriptors from index 1 on, ASCII
};

class UsbDevice {
 public:
  // on_out: what the host sends to an endpoint, on the bus's thread; it may call send(). Not plugged in yet: whoever
  // owns the device is to be whole before a host speaks to it. Throws std::runtime_error outside umockdev-wrapper.
  UsbDevice(const UsbIdentity& identity, std::function<void(uint8_t endpoint, const UsbBytes& bytes)> on_out);
  ~UsbDevice();
  UsbDevice(const UsbDevice&) = delete;
  UsbDevice& operator=(const UsbDevice&) = delete;

  // A transfer for the host to fetch from an IN endpoint. Any thread.
  void send(uint8_t endpoint, UsbBytes transfer);
  size_t waiting_bytes(uint8_t endpoint) const;  // sent and not fetched yet
  void discard(uint8_t endpoint);                // those

  void plug_in();
  // Every transfer fails from now on; what waited is gone.
  void unplug();
  // The endpoint stalls until the host clears it.
  void halt(uint8_t endpoint);

 private:
  class Bus;
  std::unique_ptr<Bus> bus_;
};

}  // namespace selvedge::hardware_sim
