// How late the camera's clock is against the tracker's, from markers that move before both, jointly with the
// camera's pose.
//
//   minimise over t_0 and the camera's pose  Σ |pixel(R x_m(t_i + t_0) + t) − z_im|²
//
// x_m(t): a cubic spline through the tracker's samples. A scan over ± reach with the pose held at its
// calibration finds the neighbourhood, Gauss–Newton the rest; the deviation is that of the whole normal
// matrix, so what the pose can take up is not counted as known. The spline's noise is largest at the samples and
// draws the delay between them; the gradient is freed of that, and where the markers move so little that what
// remains may exceed the deviation, the delay is refused. s, m, px.
// Source: docs/calibration.md; the trial runs that it tells of.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "calib/camera_model.h"

namespace selvedge::calib {

// The tracker's samples of one marker, in time order; hidden samples left out.
struct MarkerTrack {
  int marker = 0;
  std::vector<double> time_s;              // tracker clock
  std::vector<Eigen::Vector3d> position;   // m
};

// One marker in one camera frame.
struct TimedSighting {
  double time_s = 0;      // camera clock as mapped so far
  int marker = 0;
  Eigen::Vector2d pixel;
};

struct TimeOffsetOptions {
  double reach_s = 0.1;
  double step_s = 0.002;
  double tracker_noise_m = 0.0003;
  double pixel_noise_px = 0.2;
  double gate_sd = 5;             // sightings further off are left out of the last fit
  double longest_gap_s = 0.05;    // of a track; no interpolation across longer ones
  double most_bias_share = 1.0;   // expected bias over deviation; more is refused,
  double harmless_bias_s = 5e-5;  // unless it is less than this
  double most_sd_s = 0.002;
};

struct TimeOffset {
  bool known = false;             // false: see why
  std::string why;
  double offset_s = 0;            // the tracker's time of a frame is its camera time plus this
  double sd_s = 0;
  double rms_px = 0;              // with the delay
  double rms_without_px = 0;      // with none, pose fitted as well
  double speed_px_s = 0;          // root mean square of the markers in the image
  double expected_bias_s = 0;     // by which the tracker's noise may shift it
  CameraParameters camera = CameraParameters::Zero();   // pose refined with it
  int sightings = 0;
};

TimeOffset estimate_time_offset(const CameraParameters& camera, const std::vector<MarkerTrack>& tracks,
                                const std::vector<TimedSighting>& sightings, const TimeOffsetOptions& options = {});

}  // namespace selvedge::calib
