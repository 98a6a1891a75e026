// The camera's daemon: from the device to the frame ring (pixels) and the bus (stamps, status, clock, preview).
//
// A frame's time is the middle of its exposure on the host clock: device ticks mapped by rig/clock.h, from the
// frames' arrivals and, where the device's clock can be read, from readings once a second. The map itself goes
// out on <DEVICE>_CLOCK, so that a recorder can map the ticks of a whole trial with the best map.
// Frames with missing pixels do not enter the ring; their stamps say whole = false. Frame numbers go on over a
// reconnection and a restart of the daemon with a step of at least 2, so that the hole shows. A lost device is opened
// anew for as long as the daemon runs.
#pragma once

#include <atomic>
#include <string>

#include "rig/configuration.h"

namespace selvedge::camera {

// Runs until `stopping`. device: name of the section, which is also the prefix of its channels and the name of
// its ring (frame_ring.h). Throws BadInput for what a person can mend.
void run_daemon(const rig::Configuration& configuration, const std::atomic<bool>& stopping,
                const std::string& device = "camera");

}  // namespace selvedge::camera
