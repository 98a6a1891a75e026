// Made-up markers that move before a made-up camera whose clock is late by a known time. s, m, px.
// Source: the trial runs in docs/calibration.md.
#pragma once

#include "calib/time_offset.h"
#include "geometry/projection.h"

namespace selvedge::hardware_sim {

struct MotionOptions {
  double amplitude_m = 0.12;
  double frequency_hz = 1.2;
  double duration_s = 6;
  double camera_rate_hz = 60, tracker_rate_hz = 120;
  double offset_s = 0.0137;  // tracker time of a frame less its camera time
  double tracker_noise_m = 0.0003, camera_noise_px = 0.2;
  double outlier_share = 0;  // sightings somewhere else
  int markers = 4;
  unsigned seed = 1;
};

struct SyntheticMotion {
  std::vector<calib::MarkerTrack> tracks;
  std::vector<calib::TimedSighting> sightings;
};

SyntheticMotion make_synthetic_motion(const geometry::Projection& camera, const Eigen::Vector3d& middle,
                                      const MotionOptions& options);

}  // namespace selvedge::hardware_sim
