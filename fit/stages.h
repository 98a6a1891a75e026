// The stages that every fit of a campaign goes through: reading it, finding where to start, minimising on the branches
// of equilibrium that were recorded.
#pragma once

#include <optional>

#include "capture/trial/trial.h"
#include "estimate/least_squares.h"

namespace selvedge::fit {

// All trials, thinned to rate_hz where markers were tracked and to image_rate_hz elsewhere. Throws BadInput where the
// trials are of fabrics of different sizes, or one holds too little.
std::vector<model::ObservedTrial> observe_campaign(const trial::Campaign& campaign, double rate_hz,
                                                   double image_rate_hz, const report::ProgressCallback& progress,
                                                   observe::Thinning thinning = observe::Thinning::dropped);

// The longest moving trial's last observed time, s; 0 where none moves.
double last_observed_s(const std::vector<model::ObservedTrial>& trials);

// Progress of one stage as a part of the whole.
report::ProgressCallback part_of(const report::ProgressCallback& whole, double from, double to,
                                 const std::string& name);

// minimise(), and again where the branches of equilibrium that the recording shows turn out to be others than those
// that it started from (Simulation::rematch).
estimate::LeastSquaresResult minimise_on_branches(const model::Simulation& simulation, model::State& state,
                                                  const std::vector<model::Parameter>& parameters,
                                                  const Eigen::VectorXd& start,
                                                  const estimate::LeastSquaresOptions& options);

// Of the grids that find_start takes by itself.
inline constexpr int kMostCellsAtFirst = 20;

// The finest grid that a campaign of so much motion is fitted on, cells along the width: on it an iteration takes about
// as long as one of 12 s on 24 cells does, a quarter of a minute on two cores. Work rises with the cells and with the
// steps.
int most_cells(double motion_s);

// Where to start: a search over all combinations of a few values (coarse_search.h), each rigidity on cells of its own
// bending length (at least those of `on`, at most most_cells), over the beginnings of a few trials, where a wrong
// parameter has not yet led the motion astray; the best few are each fitted to these, and the best of them is taken. On
// cells larger than its folds a soft fabric would be taken for a stiff one.
struct Start {
  Eigen::VectorXd coordinates;
  int evaluations = 0;
};
Start find_start(const std::vector<model::ObservedTrial>& trials, const model::SimulationOptions& on, int most_cells,
                 const std::vector<model::Parameter>& parameters, const estimate::LeastSquaresOptions& options);

// From a start nearer to the end: least squares over the first shares[0] of the motion, then over the first shares[1]
// from there, and so on: late in a trial a wrong parameter has led the motion so far astray that the error no longer
// says which way to go. Only what so short a motion shows is fitted, from the state's branches of equilibrium.
Start fit_beginnings(const model::Simulation& simulation, const model::State& state,
                     const std::vector<model::Parameter>& parameters, const Eigen::VectorXd& start,
                     const estimate::LeastSquaresOptions& options, const std::vector<double>& shares);

// minimise(), and once more from beside its end, damping and drag farther away than the rest. The better of the two,
// and the other where the trials do not rule it out: what differs between the two is not determined, however steep the
// valley that each lies in (folds that snap over make the error rugged, and derivatives know of one valley alone).
struct Rivals {
  estimate::LeastSquaresResult best;  // its evaluations: of both
  std::optional<Eigen::VectorXd> rival;
};
Rivals minimise_and_return(const model::Simulation& simulation, model::State& state,
                           const std::vector<model::Parameter>& parameters, const Eigen::VectorXd& start,
                           const estimate::LeastSquaresOptions& options);

}  // namespace selvedge::fit
