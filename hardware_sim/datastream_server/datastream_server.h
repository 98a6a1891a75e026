// A simulated motion-capture system: a Vicon DataStream server over TCP.
//
// It looks at the world at a fixed rate, adds Gaussian noise to every marker, hides some of them, and sends
// each frame once its latency (and a one-sided random jitter) has passed. Like the real system it says the
// latency, but not when a frame was taken, and a hidden marker is simply absent. Any number of clients may
// come and go. Layout: rig/tracker/backends/datastream_packets.h, written here from the protocol's own
// description and not from that decoder.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace selvedge::hardware_sim {

struct NamedPoint {
  std::string subject;  // "fabric", "grid"; empty for an unlabelled marker
  std::string name;     // "left", "right", "g0_0"; empty for an unlabelled marker
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
};

struct DatastreamServerOptions {
  std::string address = "127.0.0.1";
  int port = 0;                      // 0: the system chooses
  double rate_hz = 120;
  double noise_m = 0.2e-3;           // one standard deviation per axis
  double latency_s = 5e-3;           // exposure to sending
  double stated_latency_s = -1;      // what LatencyInfo says; negative: the true one
  double jitter_s = 0.3e-3;          // mean of the exponential delay on top, which nobody states
  double occlusions_per_s = 0;       // per marker, how often it disappears
  double occlusion_s = 0.05;         // mean length of a disappearance
  double drop_probability = 0;       // of a whole frame (its number is then missing)
  double swap_probability = 0;       // of a frame in which the first two markers carry each other's label
  double ghost_probability = 0;      // of a frame with one unlabelled marker that does not exist
  unsigned seed = 1;
};

struct DatastreamServerCounts {
  std::int64_t frames = 0, frames_dropped = 0, markers_hidden = 0, swaps = 0, ghosts = 0, clients = 0,
               disconnects = 0;
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

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace selvedge::hardware_sim
