// CMA-ES (Hansen 2006) through pagmo's `cmaes`, in batches.
//
// pagmo evaluates one individual at a time. The points of a generation do not depend on its costs, so each
// generation is rehearsed on a copy of algorithm and population that only notes the points; they are evaluated
// together, and the generation proper looks their costs up.
#pragma once

#include "estimate/optimisers/search.h"

namespace selvedge::estimate {

SearchResult search_cma(const SearchProblem& problem, const SearchLimits& limits);

}  // namespace selvedge::estimate
