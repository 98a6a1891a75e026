// The corner tracker's daemon: from a motion-capture system to corner_sample_t on the bus.
//
// A frame's time is its capture time as the back-end estimates it (arrival less stated latency), with the
// network's jitter taken out: frame numbers are regressed against those estimates by the lower envelope of
// rig/clock.h. A lost connection is tried again twice a second for as long as the daemon runs.
#pragma once

#include <atomic>
#include <string>

#include "rig/configuration.h"
#include "rig/tracker/tracker.h"

namespace selvedge::tracker {

struct TrackerConfiguration {
  std::string backend = "datastream";  // or "natnet"
  TrackerOptions connection;           // host, port, connect_timeout_s, y_up
  double silence_s = 1;                // no frame for so long counts as a lost connection
};

// [tracker] of the configuration. Throws BadInput.
TrackerConfiguration read_configuration(rig::Section keys);

std::unique_ptr<Tracker> connect_tracker(const TrackerConfiguration& configuration);

// Runs until `stopping`. device: name of the section, which is also the prefix of its channels.
void run_daemon(const rig::Configuration& configuration, const std::atomic<bool>& stopping,
                const std::string& device = "tracker");

}  // namespace selvedge::tracker
