// A simulated Universal Robots controller: an RTDE server, and a stand-in for the script of external control.
//
// The joints move only as the script is told: a first-order lag behind the (linearly extrapolated) set-point, under
// limits of speed and acceleration. A set-point beyond a joint's range, or one that would need 1.5 times a joint's
// speed, is a protective stop, as is a call of protective_stop(). Packets that stay away for longer than the time-out
// in the last one end the script: the joints brake, and it connects anew.
// Written from the protocol's description, not from the driver.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <Eigen/Core>

#include "rig/arm/model.h"

namespace selvedge::hardware_sim {

struct RtdeControllerOptions {
  std::string address = "127.0.0.1";
  int port = 0;  // RTDE; 0: the system chooses
  std::string script_host = "127.0.0.1";
  int script_port = 50001;  // where the script connects to
  double lag_s = 0.02;      // time constant behind the set-point
  double encoder_noise_rad = 1e-5;
  double clock_offset_s = 5;   // the controller's own clock starts so much later than the host's
  double clock_drift_ppm = 0;  // positive: it runs fast
  double script_reconnect_s = 0.2;
  unsigned seed = 1;
};

struct RtdeControllerCounts {
  std::int64_t set_points = 0, scripts_timed_out = 0, protective_stops = 0, clients = 0;
};

class RtdeController {
 public:
  // Starts at the model's home position. Throws std::runtime_error where the port is taken.
  RtdeController(const RtdeControllerOptions& options, const arm::ArmModel& model);
  ~RtdeController();

  int port() const;
  RtdeControllerCounts counts() const;
  // True joint angles and tool point (arm base frame) at a host time of the last seconds; linear between steps.
  Eigen::VectorXd joints_at(double host_time_s) const;
  Eigen::Vector3d tool_at(double host_time_s) const;
  // Largest joint speed since a host time, rad/s.
  double fastest_since(double host_time_s) const;

  void protective_stop();
  void clear_protective_stop();
  void cut_connections();                     // RTDE and script
  void block_joint(int joint, bool blocked);  // it does not move whatever is commanded

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace selvedge::hardware_sim
