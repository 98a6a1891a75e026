// An arm's controller as the daemon sees it: one call a control cycle.
//
// The controller keeps the beat. A set-point is a position for every joint; without one the controller is asked
// to stay as it is, and the connection is kept alive.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <Eigen/Core>

namespace selvedge::arm {

struct ArmSample {
  double time_s = 0;             // host clock, when the controller measured the joints
  Eigen::VectorXd q_rad;         // measured
  Eigen::VectorXd qd_rad_s;      // measured, or differenced where the controller does not say
  bool ready = false;            // the controller would follow a set-point
  std::string not_ready;         // why not, for a person
  bool protective_stop = false;  // the controller stopped by itself
  std::string intruder;          // who else spoke where the controller belongs, for a person; "": nobody did
};

class Arm {
 public:
  virtual ~Arm() = default;
  // Sends the set-point (or none) and waits for the controller's next sample; none after timeout_s.
  // Throws wire::Disconnected and wire::WireError; this Arm is then finished.
  virtual std::optional<ArmSample> cycle(const std::optional<Eigen::VectorXd>& set_point_rad, double timeout_s) = 0;
  virtual double period_s() const = 0;
};

struct ArmOptions {
  std::string host = "127.0.0.1";
  int port = 0;                // 0: the protocol's own
  int script_port = 50001;     // rtde: where the robot's script connects to
  std::string script_address;  // where it is awaited; "": this host's address that faces the robot
  double rate_hz = 125;
  double controller_timeout_s = 0.1;  // the controller stops by itself after so long without a set-point
  double connect_timeout_s = 2;
  int joints = 6;
};

std::unique_ptr<Arm> connect_rtde(const ArmOptions& options);  // Universal Robots (backends/rtde.cpp)
std::unique_ptr<Arm> connect_mxt(const ArmOptions& options);   // Mitsubishi MELFA (backends/mxt.cpp)

}  // namespace selvedge::arm
