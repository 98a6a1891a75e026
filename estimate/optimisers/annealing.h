// Continuous simulated annealing: downhill simplex with thermal fluctuations (Press et al., Numerical Recipes,
// section 10.9), as Bhat et al. 2003, section 6 use it.
//
// Every stored cost is raised and every new one lowered by −T ln(u), u uniform in (0, 1), when they are compared:
// a downhill step is always taken, an uphill one with a likelihood that falls with T. T cools geometrically. When T
// has fallen by `reset_factor` the simplex is built anew around the best point so far. Neither source says how
// large: its edges shrink with √T, as the width of a quadratic valley below the level T does.
#pragma once

#include "estimate/optimisers/search.h"

namespace selvedge::estimate {

struct AnnealingOptions {
  double edge = 0.15;              // of the first simplex, in shares of the box
  double first_temperature = 0;    // in units of cost; 0: half the spread of the first simplex's costs
  double cooling = 0.9;            // T ← cooling · T
  double last_temperature = 1e-3;  // in shares of the first, reached when the budget ends
  double reset_factor = 3;
};

SearchResult anneal(const SearchProblem& problem, const SearchLimits& limits, const AnnealingOptions& options = {});

}  // namespace selvedge::estimate
