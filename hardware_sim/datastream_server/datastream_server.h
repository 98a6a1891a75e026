// A simulated motion-capture system: a Vicon DataStream server over TCP.
//
// It looks at the world at a fixed rate, adds Gaussian noise to every marker, hides some of them, and sends
// each frame once its latency (and a one-sided random jitter) has passed. Like the real system it says the
// latency, but not when a frame was taken, and a hidden marker is simply absent. Any number of clients may
// come and go. Layout: rig/tracker/backends/datastream_packets.h, written here from the protocol's own
// description and not from that decoder.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hardware_sim/simulated_mocap/simulated_mocap.h"

namespace selvedge::hardware_sim {

struct DatastreamServerOptions : MocapOptions {
  std::string address = "127.0.0.1";
  int port = 0;                  // 0: the system chooses
  double stated_latency_s = -1;  // what LatencyInfo says; negative: the true one
  double awake_s = 0;            // busy so long before each frame leaves: the host's timers alone are 0.1 ms late
};

struct DatastreamServerCounts : MocapCounts {
  std::int64_t clients = 0, disconnects = 0;
};

class DatastreamServer {
 public:
  // markers_at(t): where the markers are at host time t (CLOCK_MONOTONIC, s). Called from the server's
  // thread, at about t. Throws std::runtime_error where the port is taken.
  DatastreamServer(const DatastreamServerOptions& options,
                   std::function<std::vector<NamedPoint>(double host_time_s)> markers_at);
  ~DatastreamServer();

  int port() const;
  DatastreamServerCounts counts() const;
  // Cuts every connection in the middle of a packet.
  void cut_connections();
  // Sends nothing for so long; the frames of that time come late, all at once.
  void stall(double seconds);
  // No marker is seen for so long; frames go on.
  void hide(double seconds);

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace selvedge::hardware_sim
