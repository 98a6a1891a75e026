// Exhaustive grid (Bhat et al. 2003, section 6): `values` of each parameter across its whole range, both ends
// included, every combination evaluated.
#pragma once

#include "estimate/optimisers/search.h"

namespace selvedge::estimate {

struct GridOptions {
  int values = 4;    // of each parameter, at least 2
  int at_once = 16;  // points a batch
};

// Throws BadInput where the budget does not hold the whole grid.
SearchResult search_grid(const SearchProblem& problem, const SearchLimits& limits, const GridOptions& options = {});

}  // namespace selvedge::estimate
