// How late the camera's clock is against the tracker's, from markers that move before both, jointly with the
// camera's pose.
//
//   minimise over t_0 and the camera's turn ω and shift τ
//     Σ rᵀΣ⁻¹r + |ω|²/s_ω² + |τ|²/s_τ²,   r = pixel(R x_m(t_i + t_0) + t) − z_im
//
// x_m(t): a cubic spline through the tracker's samples. A scan over ± reach with the pose held at its
// calibration finds the neighbourhood, Gauss–Newton the rest.
// Deviation: with the normal matrix N and the frames' gradients g_i at the solution, from N⁻¹ M N⁻¹,
//   M = Σ_ij k(|t_i − t_j| / T) g_i g_jᵀ,   k(x) = max(1 − x, 0)   (Newey and West 1987)
// so that neither the stated noise nor the independence of successive frames is taken on trust; never less than the
// residuals alone say. What the pose can take up is not counted as known. The spline's noise is largest at the samples
// and draws the delay between them; the gradient is freed of that, and what remains is added to the deviation. The
// delay is refused where the deviation leaves it open.
// A marker on a surface under stripes shows its motion far better by the projector line that lights it (station/
// held_corners.h): line(p) = line₀ + g·(p − p₀) about its place in the frame, against the line that the projector's
// matrix gives the tracked point,
//   r = line(pixel(R x_m(t_i + t_0) + t)) − line_of(x_m(t_i + t_0)) − b_m,  up to whole periods of the stripes
// with an unknown constant b_m a marker. s, m, px.
// Source: docs/calibration.md; W. K. Newey and K. D. West, Econometrica 55, 1987.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "calib/camera_model.h"

namespace selvedge::calib {

// The tracker's samples of one marker, in time order; hidden samples left out.
struct MarkerTrack {
  int marker = 0;
  std::vector<double> time_s;             // tracker clock
  std::vector<Eigen::Vector3d> position;  // m
};

// One marker in one camera frame.
struct TimedSighting {
  double time_s = 0;  // camera clock as mapped so far
  int marker = 0;
  Eigen::Vector2d pixel;
};

// The projector's line about one marker in one camera frame.
struct LineMap {
  Eigen::Vector2d at;      // p₀, of the camera
  double line_px = 0;      // there, of the projector
  Eigen::Vector2d per_px;  // g
  double line_at(const Eigen::Vector2d& pixel) const { return line_px + per_px.dot(pixel - at); }
};
struct TimedLine {
  double time_s = 0;
  int marker = 0;
  LineMap line;
};

// What a projector's stripes say of moving markers.
struct TimedLines {
  CameraParameters projector = CameraParameters::Zero();
  bool rows = true;  // stripes run along the rows; else along the columns
  double period_px = 16;
  double noise_px = 0.3;  // of a line
  std::vector<TimedLine> sightings;
};

struct TimeOffsetOptions {
  double reach_s = 0.1;
  double step_s = 0.002;
  double tracker_noise_m = 0.0003;
  double pixel_noise_px = 0.2;
  double gate_sd = 5;                            // sightings further off are left out of the last fit
  double longest_gap_s = 0.05;                   // of a track; no interpolation across longer ones
  double turn_sd_rad = 0.05, shift_sd_m = 0.05;  // s_ω, s_τ
  double alike_s = 0.4;                          // T: frames so close together may err alike
  double common_px = 0;      // error that may go with the motion: it adds common_px over the markers' speed
  double most_sd_s = 0.005;  // more leaves the delay open
};

struct TimeOffset {
  bool known = false;  // false: see why
  std::string why;
  double offset_s = 0;         // the tracker's time of a frame is its camera time plus this
  double sd_s = 0;             // with expected_bias_s
  double rms_px = 0;           // with the delay
  double rms_without_px = 0;   // with none, pose fitted as well
  double speed_px_s = 0;       // root mean square of what is compared, camera pixels or projector lines
  double expected_bias_s = 0;  // by which the tracker's noise may shift it
  CameraParameters camera = CameraParameters::Zero();  // pose refined with it
  int sightings = 0;
};

TimeOffset estimate_time_offset(const CameraParameters& camera, const std::vector<MarkerTrack>& tracks,
                                const std::vector<TimedSighting>& sightings, const TimeOffsetOptions& options = {});

// The same from stripes, with the camera that stands where it was found to stand (options: narrow s_ω and s_τ).
TimeOffset estimate_time_offset(const CameraParameters& camera, const std::vector<MarkerTrack>& tracks,
                                const TimedLines& lines, const TimeOffsetOptions& options = {});

}  // namespace selvedge::calib
