#include "estimate/optimisers/registry.h"

#include "files/bad_input.h"
#include "estimate/optimisers/annealing.h"
#include "estimate/optimisers/cma.h"
#include "estimate/optimisers/evolution.h"
#include "estimate/optimisers/grid.h"

namespace selvedge::estimate {

const std::vector<Optimiser>& optimisers() {
  static const std::vector<Optimiser> list = {
      {"grid", "four values of each parameter, all combinations (2003)",
       [](const SearchProblem& p, const SearchLimits& l) { return search_grid(p, l); }},
      {"annealing", "simulated annealing with downhill simplex (2003)",
       [](const SearchProblem& p, const SearchLimits& l) { return anneal(p, l); }},
      {"evolution", "evolution strategy of ranks, mutants and crossover (1995)",
       [](const SearchProblem& p, const SearchLimits& l) { return evolve(p, l); }},
      {"cma", "CMA-ES of pagmo, in batches",
       [](const SearchProblem& p, const SearchLimits& l) { return search_cma(p, l); }},
  };
  return list;
}

const Optimiser& optimiser_named(const std::string& name) {
  std::string known;
  for (const Optimiser& o : optimisers()) {
    if (o.name == name) return o;
    known += (known.empty() ? "" : ", ") + o.name;
  }
  refuse("optimiser", "found {}, expected one of {}", in_quotes(name), known);
}

}  // namespace selvedge::estimate
