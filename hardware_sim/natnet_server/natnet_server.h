// A simulated motion-capture system: an OptiTrack NatNet server over UDP, unicast.
//
// It answers connections, model and rate requests and echoes, and sends frames of bitstream 3.0 or 4.1 to everyone who
// connected or kept alive in the last seconds. Its clock counts ticks of its own. A hidden marker is missing from the
// labelled-marker section, or (fill_hidden) there with the model's guess and the flag that says so.
// Written from the protocol's description, not from the client.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hardware_sim/simulated_mocap/simulated_mocap.h"

namespace selvedge::hardware_sim {

struct NatnetServerOptions : MocapOptions {
  std::string address = "127.0.0.1";
  int port = 0;              // of commands; 0: the system chooses
  int major = 3, minor = 0;  // of the bitstream: 3.0 or 4.1
  bool fill_hidden = false;
  double ticks_per_s = 1e7;
  double clock_offset_s = 1234.5;  // its clock reads so much more than the host's
  double clock_drift_ppm = 20;     // positive: it runs fast
};

class NatnetServer {
 public:
  // markers_at(t): where the markers are at host time t. Called from the server's thread, at about t.
  NatnetServer(const NatnetServerOptions& options,
               std::function<std::vector<NamedPoint>(double host_time_s)> markers_at);
  ~NatnetServer();

  int port() const;
  MocapCounts counts() const;
  // Says nothing to anybody for so long, and forgets who was connected.
  void fall_silent(double seconds);

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace selvedge::hardware_sim
