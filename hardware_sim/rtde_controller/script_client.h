// Stands in for the script of external control on the robot: connects to the PC, reads eight big-endian i32 a cycle
// (time-out ms, six joint angles in 1e-6 rad, mode), extrapolates linearly over missing packets, and ends where
// they stay away for longer than the time-out in the last packet.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "rig/wire/socket.h"

namespace selvedge::hardware_sim {

class ScriptClient {
 public:
  ScriptClient(std::string host, int port, double reconnect_s)
      : host_(std::move(host)), port_(port), reconnect_s_(reconnect_s) {}

  // What servoj is called with at host time now_s; none in idle mode or without a connection.
  std::optional<Eigen::VectorXd> servo_target(double now_s, int joints);
  // Ends the script; it connects anew a little later.
  void stop();

  bool running() const { return socket_.is_open(); }
  std::int64_t set_points() const { return set_points_; }
  std::int64_t timed_out() const { return timed_out_; }

 private:
  void connect(double now_s);
  void read(double now_s, int joints);

  const std::string host_;
  const int port_;
  const double reconnect_s_;
  wire::Socket socket_;
  std::vector<std::uint8_t> received_;
  double next_try_s_ = 0;
  double timeout_s_ = 0, packet_s_ = 0;
  struct Target {
    double time_s;
    Eigen::VectorXd q_rad;
  };
  std::optional<Target> last_, before_;
  std::int64_t set_points_ = 0, timed_out_ = 0;
};

}  // namespace selvedge::hardware_sim
