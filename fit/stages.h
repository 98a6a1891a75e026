// The stages that every fit of a campaign goes through: reading it, finding where to start, minimising on the branches
// of equilibrium that were recorded.
#pragma once

#include <optional>

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
report::ProgressCallback part_of(const report::ProgressCallback& whole, double from, double to,
                                 const std::string& name);

// minimise(), and again where the branches of equilibrium that the recording shows turn out to be others than those
// that it started from (Objective::rematch).
LeastSquaresResult minimise_on_branches(Objective& objective, const std::vector<Parameter>& parameters,
                                        const Eigen::VectorXd& start, const LeastSquaresOptions& options);

// Where to start, on the mesh of `on`: a coarse grid (coarse_search.h) over the beginnings of a few trials, where a
// wrong parameter has not yet led the motion astray; the best few are each fitted to these, and the best of them is
// taken.
struct Start {
  Eigen::VectorXd coordinates;
  int evaluations = 0;
};
Start find_start(const std::vector<ObservedTrial>& trials, const ObjectiveOptions& on,
                 const std::vector<Parameter>& parameters, const LeastSquaresOptions& options);

// From a start nearer to the end: least squares over the first shares[0] of the motion, then over the first shares[1]
// from there, and so on: late in a trial a wrong parameter has led the motion so far astray that the error no longer
// says which way to go. Only what so short a motion shows is fitted, from the objective's branches of equilibrium.
Start fit_beginnings(const Objective& objective, const std::vector<Parameter>& parameters, const Eigen::VectorXd& start,
                     const LeastSquaresOptions& options, const std::vector<double>& shares);

// minimise(), and once more from beside its end, damping and drag farther away than the rest. The better of the two,
// and the other where the trials do not rule it out: what differs between the two is not determined, however steep the
// valley that each lies in (folds that snap over make the error rugged, and derivatives know of one valley alone).
struct Rivals {
  LeastSquaresResult best;  // its evaluations: of both
  std::optional<Eigen::VectorXd> rival;
};
Rivals minimise_and_return(Objective& objective, const std::vector<Parameter>& parameters, const Eigen::VectorXd& start,
                           const LeastSquaresOptions& options);

}  // namespace selvedge::fit
