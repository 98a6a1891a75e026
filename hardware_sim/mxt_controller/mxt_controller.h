// A simulated MELFA controller whose program runs `Mxt`: UDP, 196 bytes each way, a reply to each packet and nothing
// else.
//
// dat1 is the command after a first-order filter, dat2 the encoders with noise. A step in the command beyond 1.5 times
// a joint's speed in a cycle, or a set-point out of range, is an alarm; so is silence for 10 cycles once it was
// commanded. After an alarm or command 255 it answers nothing until its program is started anew; after an alarm of
// silence, it is told to start itself again after restart_s.
// Written from the protocol's description, not from the driver.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <Eigen/Core>

#include "rig/arm/model.h"

namespace selvedge::hardware_sim {

struct MxtControllerOptions {
  std::string address = "127.0.0.1";
  int port = 0;  // 0: the system chooses
  double lag_s = 0.02;
  double encoder_noise_rad = 1e-5;
  double silence_s = 0.071;  // 10 cycles of 7.1 ms; infinite: a controller that never gives up
  double restart_s = 0.3;    // after an alarm of silence; infinite: a person starts the program
  unsigned seed = 1;
};

class MxtController {
 public:
  // Starts at the model's home position, its program running.
  MxtController(const MxtControllerOptions& options, const arm::ArmModel& model);
  ~MxtController();

  int port() const;
  Eigen::VectorXd joints_at(double host_time_s) const;
  Eigen::Vector3d tool_at(double host_time_s) const;
  double fastest_since(double host_time_s) const;
  std::int64_t set_points() const;
  bool alarm() const;

  void raise_alarm();
  void restart_program();  // clears the alarm
  void block_joint(int joint, bool blocked);

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace selvedge::hardware_sim
