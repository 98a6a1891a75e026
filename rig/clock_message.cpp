#include "rig/clock_message.h"

#include <cmath>

namespace selvedge::rig {

selvedge_rig::clock_map_t to_message(const ClockMap& map, const std::string& device) {
  selvedge_rig::clock_map_t message{};
  message.utime = host_now_us();
  message.device = device;
  message.ticks_per_s = map.ticks_per_s;
  message.reference_ticks = map.reference_ticks;
  message.reference_utime = std::llround(map.reference_host_s * 1e6);
  message.drift_ppm = map.drift_ppm;
  message.uncertainty_s = map.uncertainty_s;
  message.samples = map.samples;
  message.jumps = map.jumps;
  return message;
}

ClockMap from_message(const selvedge_rig::clock_map_t& message) {
  ClockMap map;
  map.ticks_per_s = message.ticks_per_s;
  map.reference_ticks = message.reference_ticks;
  map.reference_host_s = static_cast<double>(message.reference_utime) * 1e-6;
  map.drift_ppm = message.drift_ppm;
  map.uncertainty_s = message.uncertainty_s;
  map.samples = message.samples;
  map.jumps = message.jumps;
  return map;
}

}  // namespace selvedge::rig
