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

  // What is at x is seen at x + turn × x + shift: the camera stands otherwise in the tracker's frame than was
  // calibrated.
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero(), shift_m = Eigen::Vector3d::Zero();
  double depth_bias = 0;         // distances from the camera are seen longer by this share
  double smoothing_s2 = 0;       // a tracker's smoothing over time: variance of its Gaussian weights
  double outline_jitter = 0;     // share of the held markers' jumps in a frame that other markers show
  double outline_erosion_m = 0;  // the outline, and with it the nodes of a grid, lies so far inside the fabric's edge
  double grid_drift = 0;         // share by which a grid's nodes are spaced evenly as seen, not on the fabric
};

}  // namespace selvedge::observe
