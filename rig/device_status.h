// What a device daemon says about itself twice a second, on channel <DEVICE>_STATUS.
//
// The daemon counts as it goes and calls publish_if_due() in its loop; rate_hz is what was delivered since the
// message before.
#pragma once

#include <cstdint>
#include <string>

#include <selvedge_rig/device_status_t.hpp>

#include "rig/bus.h"

namespace selvedge::rig {

class DeviceStatus {
 public:
  DeviceStatus(Bus& bus, const std::string& device);

  // state: a constant of device_status_t. A change is published at once and logged with its message.
  void set_state(int8_t state, const std::string& message);
  int8_t state() const { return message_.state; }

  void delivered(int64_t count = 1) { message_.delivered += count; }
  void dropped(int64_t count = 1) { message_.drops += count; }
  void set_refused(int64_t total) { message_.refused = total; }
  void set_temperature_degc(double value);

  void publish_if_due();

 private:
  void publish();

  Bus& bus_;
  std::string channel_;
  selvedge_rig::device_status_t message_{};
  int64_t delivered_before_ = 0;
  int64_t published_us_ = 0;
};

}  // namespace selvedge::rig
