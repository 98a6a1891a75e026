// Exhaustive grid (Bhat et al. 2003, section 6): four values of each parameter across its whole range, both ends
// included, every combination evaluated.
#pragma once

#include "estimate/optimisers/search.h"

namespace selvedge::estimate {

// Throws BadInput where the budget does not hold the whole grid.
SearchResult search_grid(const SearchProblem& problem, const SearchLimits& limits);

}  // namespace selvedge::estimate
