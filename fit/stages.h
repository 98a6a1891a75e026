// The stages that every fit of a campaign goes through: reading it, finding where to start, minimising on the branches
// of equilibrium that were recorded.
#pragma once

#include "capture/trial/trial.h"
#include "fit/least_squares.h"

namespace selvedge::fit {

// All trials, thinned to rate_hz where markers were tracked and to image_rate_hz elsewhere. Throws BadInput where the
// trials are of fabrics of different sizes, or one holds too little.
std::vector<ObservedTrial> observe_campaign(const trial::Campaign& campaign, double rate_hz, double image_rate_hz,
                                            const report::ProgressCallback& progress);

// The longest moving trial's last observed time, s; 0 where none moves.
double last_observed_s(const std::vector<ObservedTrial>& trials);

// Progress of one stage as a part of the whole.
report::ProgressCallback part_of(const report::ProgressCallback& whole, double from, double to, const std::string& name);

// minimise(), and again where the branches of equilibrium that the recording shows turn out to be others than those
// that it started from (Objective::rematch).
LeastSquaresResult minimise_on_branches(Objective& objective, const std::vector<Parameter>& parameters, const Eigen::VectorXd& start,
                                        const LeastSquaresOptions& options);

// Where to start, on the mesh of `on`: a coarse grid (coarse_search.h) over the beginnings of a few trials, where a wrong
// parameter has not yet led the motion astray; the best few are each fitted to these, and the best of them is taken.
struct Start {
  Eigen::VectorXd coordinates;
  int evaluations = 0;
};
Start find_start(const std::vector<ObservedTrial>& trials, const ObjectiveOptions& on, const std::vector<Parameter>& parameters,
                 const LeastSquaresOptions& options);

}  // namespace selvedge::fit
