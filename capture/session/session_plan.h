// What a session does: sections [session], [session.NAME] a trial, [fabric] and [calibration] of the rig's
// configuration. Unknown keys are refused.
//
//   [session]
//   trials = ["static-1", "waving-1", "robot-1"]   # in this order
//   [session.waving-1]
//   kind = "waving"
//   frequency_hz = 0.9
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "capture/trial/trial.h"
#include "rig/configuration.h"
#include "rig/projector/pattern.h"

namespace selvedge::session {

struct TrialPlan {
  std::string name;
  trial::Experiment kind = trial::Experiment::static_hang;
  double duration_s = 4;                                 // of the recording
  double lead_in_s = 0.5;                                // recorded at rest before anything moves
  double tail_s = 0.2;                                   // recorded after the motion
  double amplitude_m = 0.06;                             // waving, robot
  double frequency_hz = 0.9;                             // waving, robot
  double ramp_s = 1;                                     // robot: of the sinusoid, at either end
  Eigen::Vector3d direction = Eigen::Vector3d::UnitY();  // robot: motion-capture frame
  int attempts = 3;                                      // a trial that a device spoils is recorded again
};

// The marker grid; projector and camera say their sizes themselves.
struct GridPlan {
  int columns = 6, rows = 5;  // markers are named g<row>_<column> from the top left
  int poses = 8;
  double tracker_noise_m = 0.0003;                                  // one standard deviation per axis
  Eigen::Vector3d volume_low_m = Eigen::Vector3d(-0.3, -0.2, 0.5);  // where the fabric moves
  Eigen::Vector3d volume_high_m = Eigen::Vector3d(0.3, 0.2, 1.2);
};

struct SessionPlan {
  trial::Fabric fabric;
  GridPlan grid;
  projector::Pattern stripes;  // shown in the trials
  std::vector<TrialPlan> trials;
  Eigen::Vector3d gravity_m_s2 = Eigen::Vector3d(0, 0, -9.81);
  double frame_rate_hz = 30;     // from [camera]
  double exposure_s = 0.002;     // from [camera]
  double rest_timeout_s = 60;    // for the fabric to come to rest; later trials start as they are
  double grey_noise_levels = 1;  // of the camera, one standard deviation
  double answer_timeout_s = 60;  // for a device or person to do what was asked
};

SessionPlan read_session_plan(const rig::Configuration& configuration);

}  // namespace selvedge::session
