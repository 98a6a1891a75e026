#include "estimate/optimisers/cma.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>

#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>

#include "estimate/optimisers/search_budget.h"

namespace selvedge::estimate {

namespace {

constexpr double kSigma = 0.15;  // first standard deviation, in shares of the box
// It ends where neither points (in shares of the box) nor costs differ by more, relative.
constexpr double kTolerance = 1e-9;

using Points = std::vector<std::vector<double>>;

struct Rehearsal {
  bool noting = false;
  Points noted;
  std::map<std::vector<double>, double> costs;
};

// What pagmo sees: the unit box, and costs that are already there.
struct UnitBox {
  std::shared_ptr<Rehearsal> rehearsal;
  size_t parameters = 1;

  std::vector<double> fitness(const std::vector<double>& x) const {
    if (rehearsal->noting) {
      rehearsal->noted.push_back(x);
      return {0};
    }
    return {rehearsal->costs.at(x)};
  }
  std::pair<std::vector<double>, std::vector<double>> get_bounds() const {
    return {std::vector<double>(parameters, 0.0), std::vector<double>(parameters, 1.0)};
  }
};

void look_up(SearchBudget& budget, Rehearsal& rehearsal, const Points& points) {
  Eigen::MatrixXd columns(budget.parameters(), static_cast<Eigen::Index>(points.size()));
  for (size_t i = 0; i < points.size(); ++i)
    columns.col(static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::VectorXd>(points[i].data(), budget.parameters());
  const std::vector<double> costs = budget.costs(columns);
  for (size_t i = 0; i < points.size(); ++i)
    rehearsal.costs[points[i]] = std::isfinite(costs[i]) ? costs[i] : 1e300;  // pagmo sums them
}

bool has_converged(const pagmo::population& population) {
  const auto f = population.get_f();
  const auto x = population.get_x();
  double low = f[0][0], high = low, apart = 0;
  for (size_t i = 0; i < f.size(); ++i) {
    low = std::min(low, f[i][0]);
    high = std::max(high, f[i][0]);
    for (size_t k = 0; k < x[i].size(); ++k) apart = std::max(apart, std::abs(x[i][k] - x[0][k]));
  }
  return apart < kTolerance || high - low <= kTolerance * std::abs(low) * 1e-3;
}

}  // namespace

SearchResult search_cma(const SearchProblem& problem, const SearchLimits& limits) {
  SearchBudget budget(problem, limits);
  const auto n = static_cast<size_t>(budget.parameters());
  // 4 + 3 ln(parameters), rounded up to a multiple of 4, which are lanes; pagmo wants five.
  const auto usual = static_cast<size_t>(4 * std::ceil((4 + 3 * std::log(static_cast<double>(n))) / 4));
  const size_t individuals = std::max<size_t>(usual, 5);

  auto rehearsal = std::make_shared<Rehearsal>();
  pagmo::population population(pagmo::problem(UnitBox{rehearsal, n}), 0, limits.seed);
  std::mt19937_64 random(limits.seed);
  std::normal_distribution<double> normal(0, kSigma);
  Points first;
  for (size_t i = 0; i < individuals; ++i) {
    const Eigen::VectorXd start = budget.unit_start();
    std::vector<double> x(start.data(), start.data() + n);
    if (i > 0)
      for (double& value : x) value = std::clamp(value + normal(random), 0.0, 1.0);
    first.push_back(std::move(x));
  }
  look_up(budget, *rehearsal, first);
  for (const std::vector<double>& x : first) population.push_back(x);

  // One generation a call, with memory; its own tolerances off: ours see the whole population.
  pagmo::cmaes algorithm(1, -1, -1, -1, -1, kSigma, 0, 0, true, true, limits.seed);
  while (!budget.over()) {
    rehearsal->noted.clear();
    rehearsal->noting = true;
    pagmo::cmaes copy = algorithm;
    copy.evolve(population);
    rehearsal->noting = false;
    look_up(budget, *rehearsal, rehearsal->noted);
    population = algorithm.evolve(population);
    rehearsal->costs.clear();
    if (has_converged(population)) break;
  }
  return budget.result();
}

}  // namespace selvedge::estimate
