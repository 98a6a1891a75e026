// A coarse exhaustive search (Bhat et al. 2003, section 6): four values of each decisive parameter over its
// range, every combination simulated on a coarse mesh; the best one starts the optimiser.
#pragma once

#include "fit/least_squares.h"

namespace selvedge::fit {

struct CoarseResult {
  Eigen::VectorXd coordinates;
  double cost = 0;
  int evaluations = 0;
};

CoarseResult coarse_search(Objective& objective, const std::vector<Parameter>& parameters,
                           const LeastSquaresOptions& options);

}  // namespace selvedge::fit
