// The fold metric (fold_metric.h) as what an optimiser minimises: E per frame of simulated trials beside recorded ones.
//
// Of each recorded frame the angle map and the silhouette are computed once. A parameter set is simulated, pictured and
// compared frame by frame; E of a trial is the mean over its frames (the papers' tables give it so), of several
// trials their sum. A parameter set's E does not depend on the others of its batch.
// A simulated sheet is pictured by the projector row that lights each pixel, without light and shadow.
#pragma once

#include "fit/fold_metric.h"
#include "model/simulation.h"
#include "estimate/optimisers/search.h"

namespace selvedge::fit {

// The recorded side of one trial.
struct FoldTrack {
  geometry::Projection camera, projector;
  render::StripePattern pattern;
  std::vector<double> time_s;
  std::vector<AngleMap> recorded;
};

struct FoldTrackOptions {
  double rate_hz = 30;      // frames are thinned to about this rate
  size_t most_frames = 50;  // the first ones (2003: 50)
};

// Of a still trial its first frame alone. Throws BadInput where the trial has no images, camera, projector or pattern.
FoldTrack track_folds(const trial::Trial& trial, const FoldTrackOptions& options, bool still);

class FoldObjective {
 public:
  // scenes: meshes and experiments, on the branches of state; its trials and `tracks` correspond. Both must outlive
  // this.
  FoldObjective(const model::Simulation& scenes, const model::State& state, const std::vector<FoldTrack>& tracks);

  // E per frame, sets × trials (all of them where `trials` is empty, otherwise those, in that order); infinity where
  // a simulation diverged. coordinates: parameters × sets.
  Eigen::MatrixXd energy(const std::vector<model::Parameter>& parameters, const Eigen::MatrixXd& coordinates,
                         const std::vector<size_t>& trials = {}) const;

 private:
  const model::Simulation& scenes_;
  const model::State state_;
  const std::vector<FoldTrack>& tracks_;
};

// The quadratic that Bhat et al. 2003, section 5, draw through perturbed parameters: each is moved to ± 20 %
// in three steps a side, and the change that raises E by 1 % is read off, in % of the value; infinity where the
// quadratic does not open upwards.
std::vector<double> variability_percent(const estimate::BatchCosts& costs,
                                        const std::vector<model::Parameter>& parameters, const Eigen::VectorXd& point);

}  // namespace selvedge::fit
