// A corner tracker: a motion-capture system that reports single markers by name.
//
// Positions are in the motion-capture frame, m, z up. Times are seconds of the host clock
// (CLOCK_MONOTONIC). A marker that the system knows but did not see in a frame is `occluded`, and its
// position is NaN; no back-end ever reports (0, 0, 0) for it.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace selvedge::tracker {

struct TrackedMarker {
  std::string subject;  // "fabric", "grid"; empty for an unlabelled marker
  std::string name;     // "left", "right", "g0_0"; empty for an unlabelled marker
  Eigen::Vector3d position_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  bool occluded = true;
};

struct TrackerFrame {
  std::int64_t frame_number = 0;  // of the motion-capture system; a step above 1 is a lost frame
  double arrival_s = 0;           // host clock, when the last byte arrived
  double capture_s = 0;           // host clock, mid-exposure: arrival less latency, before any regression
  double network_s = 0;     // shortest way from the system to here, still in capture_s; 0 where capture_s is free of it
  double capture_sd_s = 0;  // of capture_s − network_s, the part that no regression takes out
  double latency_s = 0;     // exposure to sending, as the system states it; 0 where it says nothing
  double rate_hz = 0;       // as the system states it; 0 before it did
  std::vector<TrackedMarker> markers;
};

class Tracker {
 public:
  virtual ~Tracker() = default;
  // The next frame; none after timeout_s. Throws wire::Disconnected where the connection is gone and
  // wire::WireError where what came is not the protocol; either way this Tracker is finished.
  virtual std::optional<TrackerFrame> next(double timeout_s) = 0;
  // Packets that were dropped as malformed since the connection was made.
  virtual std::int64_t refused() const = 0;
};

// Where the system is. Each back-end reads what it needs.
struct TrackerOptions {
  std::string host = "127.0.0.1";
  int port = 0;       // 0: the protocol's own
  bool y_up = false;  // natnet: the system's y axis points up (Motive's default)
  double connect_timeout_s = 2;
};

// Vicon DataStream over TCP (backends/datastream.cpp). Throws wire::Disconnected where nobody answers.
std::unique_ptr<Tracker> connect_datastream(const TrackerOptions& options);
// OptiTrack NatNet over UDP (backends/natnet.cpp). Throws as connect_datastream does.
std::unique_ptr<Tracker> connect_natnet(const TrackerOptions& options);

}  // namespace selvedge::tracker
