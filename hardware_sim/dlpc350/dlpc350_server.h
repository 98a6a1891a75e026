// The simulated DLPC350 on a SOCK_SEQPACKET socket, one 64-byte report a packet, and its TRIG_OUT_1 line.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <thread>

#include "hardware_sim/dlpc350/device.h"
#include "rig/wire/socket.h"

namespace selvedge::hardware_sim {

struct TriggerEdge {
  double host_time_s = 0;  // when the line changed
  bool rising = false;     // rising: a picture begins to show; falling: its exposure ends
};

class Dlpc350Server {
 public:
  // on_trigger: called from the device's own thread at about the time of each edge; may be empty.
  Dlpc350Server(const std::filesystem::path& socket_path, const Dlpc350Options& options,
                std::function<void(const TriggerEdge&)> on_trigger = {});
  ~Dlpc350Server();

  projector::Pattern pattern_at(double host_time_s) const { return device_.pattern_at(host_time_s); }
  Dlpc350Device& device() { return device_; }
  // Pulls the plug of the connection.
  void disconnect() { disconnect_ = true; }
  // Answers nothing for so long.
  void hang(double seconds);

 private:
  void serve();
  void drive_trigger();

  Dlpc350Device device_;
  std::filesystem::path path_;
  wire::Socket listener_;
  std::function<void(const TriggerEdge&)> on_trigger_;
  std::atomic<bool> stopping_ = false, disconnect_ = false;
  std::atomic<double> hangs_until_s_ = 0;
  std::thread server_, trigger_;
};

}  // namespace selvedge::hardware_sim
