#include "estimate/optimisers/grid.h"

#include <algorithm>
#include <cmath>

#include "files/bad_input.h"
#include "estimate/optimisers/search_budget.h"

namespace selvedge::estimate {

namespace {

constexpr int kValues = 4;    // of each parameter
constexpr long kAtOnce = 16;  // points a batch

}  // namespace

SearchResult search_grid(const SearchProblem& problem, const SearchLimits& limits) {
  SearchBudget budget(problem, limits);
  const Eigen::Index n = budget.parameters();
  const double all = std::pow(kValues, static_cast<double>(n));
  if (all > limits.evaluations)
    refuse("grid",
           "found a budget of {} evaluations, expected at least {:.0f} ({} values of {} parameters); fit fewer "
           "parameters or allow more",
           limits.evaluations, all, kValues, n);
  const auto count = static_cast<long>(all);
  for (long first = 0; first < count && !budget.over(); first += kAtOnce) {
    const long batch = std::min(kAtOnce, count - first);
    Eigen::MatrixXd points(n, batch);
    for (long i = 0; i < batch; ++i) {
      long digits = first + i;
      for (Eigen::Index k = 0; k < n; ++k, digits /= kValues)
        points(k, i) = static_cast<double>(digits % kValues) / (kValues - 1);
    }
    budget.costs(points);
  }
  return budget.result("whole grid");
}

}  // namespace selvedge::estimate
