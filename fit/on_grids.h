// The last stage of a fit: on a grid that the fabric needs, and with what a finer one would add.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "estimate/least_squares.h"
#include "fit/fit_outcome.h"

namespace selvedge::fit {

model::SimulationOptions on_grid_of(int cells, const FitOptions& options);

// Where a fit ends, whichever way led there.
struct LastStage {
  estimate::LeastSquaresResult fit;
  Eigen::VectorXd open;  // how far the limit of ever finer grids may lie beyond, in coordinates; 0: not known
  int evaluations = 0;
};

// Fits on a grid, from `at`, and on finer ones while the next finer one moves the fabric further than it may; then once
// more with what that one adds. Sets FitOutcome's simulation, state, grid_mm and remarks.
LastStage fit_on_grids(FitOutcome& out, const std::vector<model::ObservedTrial>& trials,
                       const std::vector<model::Parameter>& parameters, Eigen::VectorXd at, int cells,
                       estimate::LeastSquaresOptions search, const FitOptions& options);

}  // namespace selvedge::fit
