// A coarse exhaustive search (Bhat et al. 2003, section 6): four values of each decisive parameter over its
// range, every combination simulated on a coarse grid; the best one starts the optimiser.
#pragma once

#include "estimate/least_squares.h"

namespace selvedge::fit {

struct CoarseResult {
  std::vector<Eigen::VectorXd> best;  // coordinates, the best first; at least one
  std::vector<double> costs;          // of these; infinity where all simulations diverged
  int evaluations = 0;
};

// keep: how many of the best come back. Sets whose simulation diverged are left out.
CoarseResult coarse_search(const model::Simulation& simulation, const model::State& state,
                           const std::vector<model::Parameter>& parameters,
                           const estimate::LeastSquaresOptions& options, size_t keep = 1);

}  // namespace selvedge::fit
