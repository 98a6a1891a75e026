// The optimisers there are, by name.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "estimate/optimisers/search.h"

namespace selvedge::estimate {

// An optimiser by its configuration key.
struct Optimiser {
  std::string name, summary;
  std::function<SearchResult(const SearchProblem&, const SearchLimits&)> run;
};

// grid, annealing, evolution, cma.
const std::vector<Optimiser>& optimisers();

// Throws BadInput naming those there are.
const Optimiser& optimiser_named(const std::string& name);

}  // namespace selvedge::estimate
