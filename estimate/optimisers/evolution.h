// Evolution strategy of Louchet, Provot & Crochemore 1995, section 3.3.
//
// Each generation the population is sorted by cost. The better half is kept; 20 % new individuals are mutants of
// individuals from the better 80 %, 30 % are uniform crossovers of as many parents as there are parameters, drawn
// from the better half. First values are uniform in [first_lower, first_upper].
// The paper does not give the law of mutation. Here one randomly chosen parameter, or each further one with a
// likelihood of 1 / parameters, changes by a normal step. Its size is a share of the first range, drawn anew from
// 10^−4 to 10^−0.5 (log-uniform): the listings in the paper differ between individuals by shares of 10^−5 to 10^−2.
//
// `Variant::ours` adds what keeps it out of its bad cases: mutants also step along the difference of two others of the
// better half (which follows valleys that are not along an axis), and a population that has not improved by
// `least_improvement` over `patience` generations starts again, keeping nothing.
#pragma once

#include "estimate/optimisers/search.h"

namespace selvedge::estimate {

struct EvolutionOptions {
  enum class Variant { paper, ours };
  Variant variant = Variant::paper;
  int individuals = 100;
  Eigen::VectorXd first_lower, first_upper;  // in the problem's coordinates; empty: the whole box
  double least_improvement = 0.01;           // of the best cost, relative
  int patience = 25;                         // generations
};

SearchResult evolve(const SearchProblem& problem, const SearchLimits& limits, const EvolutionOptions& options = {});

}  // namespace selvedge::estimate
