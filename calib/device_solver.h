// Solves one device, camera or projector alike: which sightings to trust, the parameters, their covariance,
// and how the solution does on poses it has not seen.
//
//   linear projection with RANSAC → robust refinement → sightings within 4.5 standard deviations →
//   poses that moved, device that was knocked → order of the distortion (AIC) → least squares →
//   covariance → leave one pose out
//
// Pixels, m. Source: docs/calibration.md.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "calib/linear_projection.h"
#include "calib/pose_events.h"
#include "calib/refine.h"

namespace selvedge::calib {

struct DeviceOptions {
  RansacOptions ransac;
  double gate_sd = 4.5;           // sightings further off are rejected
  bool choose_distortion = true;  // false: k1 k2 p1 p2 always
  bool find_events = true;
  bool leave_one_pose_out = true;
  EventOptions events;
};

enum class Degeneracy {
  none,
  too_few,       // fewer than 12 sightings
  one_plane,     // all points on one plane: no solution
  inconsistent,  // no projection explains half of the sightings
  one_pose,
  flat_grid,    // the grid is flat in every pose
  undetermined  // some direction of the parameters is not seen
};

struct RejectedSighting {
  int pose = 0;
  int marker = 0;
  std::string why;
};

struct DeviceSolution {
  ImageSize size;
  Degeneracy degeneracy = Degeneracy::none;
  bool solved = false;  // there are parameters, however poor
  RefineInput input;    // with the sightings, which of them are trusted, and the stages
  Refined refined;
  Uncertainty uncertainty;
  double singular_ratio = 1;  // of the linear solution on the trusted sightings
  std::vector<PoseEvent> events;
  std::vector<RejectedSighting> rejected;
  double rms_px = 0;                      // of the residual vectors' lengths, trusted sightings
  std::map<int, double> pose_rms_px;      // all sightings of a pose, trusted or not, but for strays
  std::map<int, double> marker_rms_px;    // trusted sightings
  std::map<int, double> left_out_rms_px;  // of a pose under the fit without it
  double leave_one_pose_out_px = 0;       // of all those together; NaN with one pose
  int worst_pose = 0;
  int worst_marker = 0;

  const std::vector<Sighting>& seen() const { return *input.sightings; }
};

// name: "camera" or "projector", for the texts. sightings: of one device.
DeviceSolution solve_device(const std::string& name, std::vector<Sighting> sightings, const ImageSize& size,
                            double tracker_noise_m, const DeviceOptions& options);

// Geometry of the points alone.
bool all_on_one_plane(const std::vector<Sighting>& sightings, double tracker_noise_m);
bool flat_in_every_pose(const std::vector<Sighting>& sightings, double tracker_noise_m);

}  // namespace selvedge::calib
