// How a rig's sensors see the fabric, beside what their calibration says. Neutral values: the calibration holds.
#pragma once

#include <Eigen/Core>

namespace selvedge::observe {

struct SensorModel {
  double delay_s = 0;      // observations stamped t show the fabric at t − delay
  double drift = 0;        // s/s: the delay grows by this much a second of the recording
  double row_delay_s = 0;  // a rolling shutter: the last row is seen this much after the first
  Eigen::Vector3d projector_shift_m = Eigen::Vector3d::Zero();  // the projector moved by this since calibration
  double radial_distortion = 0;                                 // added to the camera's k1
};

}  // namespace selvedge::observe
