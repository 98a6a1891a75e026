// A clock map as it travels on the bus, channel <DEVICE>_CLOCK.
#pragma once

#include <string>

#include <selvedge_rig/clock_map_t.hpp>

#include "rig/clock.h"

namespace selvedge::rig {

selvedge_rig::clock_map_t to_message(const ClockMap& map, const std::string& device);
ClockMap from_message(const selvedge_rig::clock_map_t& message);

}  // namespace selvedge::rig
