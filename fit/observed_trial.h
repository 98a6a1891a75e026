// A recorded trial made ready for fitting: the experiment to simulate, and what was seen.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/trial/trial.h"
#include "fit/model.h"
#include "geometry/triangle_mesh.h"

namespace selvedge::fit {

// Tracked dots at the times that are compared. Position (marker, time) in column marker·times + time; NaN
// where the marker was not seen.
struct MarkerTrack {
  std::vector<double> time_s;
  std::vector<Eigen::Vector2d> uv;  // one a marker, m
  Eigen::Matrix3Xd position;        // m
  double noise_m = 3e-4;            // standard deviation of a position and axis
};

// Stripes and outline of the frames that are compared; see fit/stripe_residual.h.
struct StripeTrack;

struct ObservedTrial {
  std::string name;
  trial::Experiment kind = trial::Experiment::static_hang;
  bool still = false;            // held corners do not move: equilibrium alone is simulated
  cloth::Experiment experiment;  // material's density from the mass; sample_s set; start_shape empty
  double width_m = 0, height_m = 0;
  std::optional<MarkerTrack> markers;
  std::shared_ptr<const StripeTrack> stripes;
};

struct ObserveOptions {
  double rate_hz = 30;            // observations are thinned to about this rate
  double sample_rate_hz = 120;    // simulated positions are kept at this rate and interpolated
  double from_s = 0, to_s = 1e9;  // of the trial's own time
};

// Throws BadInput where the trial has neither markers nor images, or too little of them.
ObservedTrial observe_trial(const trial::Trial& trial, const ObserveOptions& options = {});

}  // namespace selvedge::fit
