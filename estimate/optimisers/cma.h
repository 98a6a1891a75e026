// CMA-ES (Hansen 2006) through pagmo's `cmaes`, in batches.
//
// pagmo evaluates one individual at a time. The points of a generation do not depend on its costs, so each
// generation is rehearsed on a copy of algorithm and population that only notes the points; they are evaluated
// together, and the generation proper looks their costs up.
#pragma once

#include "estimate/optimisers/search.h"

namespace selvedge::estimate {

struct CmaOptions {
  int individuals = 0;      // 0: 4 + 3 ln(parameters), rounded up to a multiple of 4
  double sigma = 0.15;      // first standard deviation, in shares of the box
  double tolerance = 1e-9;  // ends where neither points (in shares of the box) nor costs differ by more, relative
};

SearchResult search_cma(const SearchProblem& problem, const SearchLimits& limits, const CmaOptions& options = {});

}  // namespace selvedge::estimate
