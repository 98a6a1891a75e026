// Whether camera or projector still stand where their calibration says, from what each session sees anyway:
// the held corners and the markers in view.
//
// For each trial the device's turn ω and shift τ are fitted to its sightings (tracked point, pixel), drawn to
// zero with standard deviations wide against any knock, so that few or near points cannot run away:
//   minimise Σ ρ(rᵀΣ⁻¹r) + |ω|²/s_ω² + |τ|²/s_τ²
// Of a projector whose stripes run one way only one of the pixel's two coordinates is seen; the other then counts for
// nothing. The device has moved where the mean shift of the pixels of those points, all on the fabric, is larger than
// four times its deviation, the calibration's own included, and larger than a harmless size. m, px, rad. Source:
// docs/calibration.md.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/camera_model.h"
#include "calib/refine.h"

namespace selvedge::calib {

enum class Seen { both, row, column };  // which of a pixel's coordinates was seen

// What one trial shows of one device.
struct TrialSightings {
  std::string trial;
  std::vector<Sighting> sightings;  // pose, marker and row are not used
  Seen seen = Seen::both;
  std::optional<CameraParameters> calibrated;  // where this trial carries another calibration than the first
};

struct DriftOptions {
  double tracker_noise_m = 0.0003;
  double pixel_noise_px = 0.3;
  double calibration_sd_px = 0.06;  // predicted deviation per axis at the fabric
  double turn_sd_rad = 0.05, shift_sd_m = 0.05;
  double harmless_px = 0.5;
  double least_ratio = 4;
  size_t least_sightings = 20;
  double repeats_px = 0;           // of stripes: a shift is known up to whole multiples of it; 0: known outright
  double independent_share = 0.1;  // of the sightings: successive frames err alike
};

struct TrialDrift {
  std::string trial;
  bool judged = false;  // false: too few sightings
  bool moved = false;
  double shift_px = 0;  // mean length over the sightings
  double sd_px = 0;
  double turn_deg = 0;  // of the device about its centre that would shift the pixels as much
  PoseShift shift = PoseShift::Zero();
  double rms_px = 0;        // as calibrated
  double rms_after_px = 0;  // with the turn and shift
};

struct Drift {
  std::vector<TrialDrift> trials;
  std::optional<std::string> since;  // first trial from which on every judged trial has moved
  std::string sentence;
};

// device: "camera" or "projector".
Drift check_drift(const std::string& device, const CameraParameters& calibrated,
                  const std::vector<TrialSightings>& trials, const DriftOptions& options = {});

}  // namespace selvedge::calib
