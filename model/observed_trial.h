// A recorded trial made ready for fitting: the experiment to simulate, and what was seen.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/trial/trial.h"
#include "cloth/simulate.h"
#include "observe/marker_track.h"
#include "observe/stripe_residual.h"

namespace selvedge::model {

struct ObservedTrial {
  std::string name;
  trial::Experiment kind = trial::Experiment::static_hang;
  bool still = false;            // held corners do not move: equilibrium alone is simulated
  cloth::Experiment experiment;  // material's density from the mass; sample_s set; start_shape empty
  double width_m = 0, height_m = 0;
  std::optional<observe::MarkerTrack> markers;
  std::shared_ptr<const observe::StripeTrack> stripes;
  std::optional<Eigen::Vector3d> camera_centre;  // m, where the trial tells of a camera
  double recorded_from_s = 0;                    // where the recording begins; a piece of it begins later
  double lost_each_s = 0;                        // StampDrift::each_s of the campaign's markers
  double lead_s = 0;  // of a piece out of a longer trial: how it moves for so long does not count
  std::shared_ptr<const observe::MarkerTrack> before;  // of such a piece: what was seen until it begins; null: nothing
};

// Simulated positions are kept at this rate and interpolated.
inline constexpr double kSampleRate_hz = 120;

// From a motion's start until two samples after its end.
std::vector<double> sample_times(double start_s, double end_s);

// Throws BadInput where the trial has neither markers nor images, or too little of them.
ObservedTrial observe_trial(const trial::Trial& trial, const observe::ObserveOptions& options = {});

}  // namespace selvedge::model
