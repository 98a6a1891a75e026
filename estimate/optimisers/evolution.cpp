#include "estimate/optimisers/evolution.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "estimate/optimisers/search_budget.h"

namespace selvedge::estimate {

namespace {

using Eigen::Index;
using Variant = EvolutionOptions::Variant;

class Population {
 public:
  Population(SearchBudget& budget, const SearchProblem& problem, const EvolutionOptions& options, unsigned seed)
      : budget_(budget), options_(options), random_(seed), people_(budget.parameters(), options.individuals) {
    const Eigen::VectorXd range = problem.upper - problem.lower;
    first_low_ = Eigen::VectorXd::Zero(budget.parameters());
    first_high_ = Eigen::VectorXd::Ones(budget.parameters());
    if (options.first_lower.size() > 0)
      first_low_ = (options.first_lower - problem.lower).cwiseQuotient(range).cwiseMax(0.0);
    if (options.first_upper.size() > 0)
      first_high_ = (options.first_upper - problem.lower).cwiseQuotient(range).cwiseMin(1.0);
  }

  void found() {
    for (Index i = 0; i < people_.cols(); ++i)
      for (Index k = 0; k < people_.rows(); ++k) people_(k, i) = between(first_low_(k), first_high_(k));
    costs_ = budget_.costs(people_);
    sort();
  }

  void next_generation() {
    const Index count = people_.cols(), kept = count / 2, mutants = count / 5;
    Eigen::MatrixXd born(people_.rows(), count - kept);
    for (Index i = 0; i < born.cols(); ++i) born.col(i) = i < mutants ? mutant() : crossover();
    const std::vector<double> costs = budget_.costs(born);
    people_.rightCols(born.cols()) = born;
    std::copy(costs.begin(), costs.end(), costs_.begin() + kept);
    sort();
  }

  double best() const { return costs_.front(); }

 private:
  double between(double low, double high) { return low + (high - low) * uniform_(random_); }
  Index one_of(Index count) {
    return std::min<Index>(static_cast<Index>(uniform_(random_) * static_cast<double>(count)), count - 1);
  }

  Eigen::VectorXd mutant() {
    Eigen::VectorXd x = people_.col(one_of(4 * people_.cols() / 5));
    const Index half = people_.cols() / 2;
    if (options_.variant == Variant::ours && uniform_(random_) < 0.5) {
      const Index a = one_of(half), b = one_of(half);
      x += between(0, 1.5) * (people_.col(a) - people_.col(b));
      return x.cwiseMax(0.0).cwiseMin(1.0);
    }
    const Index sure = one_of(x.size());
    for (Index k = 0; k < x.size(); ++k)
      if (k == sure || uniform_(random_) * static_cast<double>(x.size()) < 1)
        x(k) += std::pow(10.0, between(-4, -0.5)) * (first_high_(k) - first_low_(k)) * normal_(random_);
    return x.cwiseMax(0.0).cwiseMin(1.0);
  }

  Eigen::VectorXd crossover() {
    const Index n = people_.rows(), half = people_.cols() / 2;
    std::vector<Index> parents(static_cast<size_t>(n));
    for (Index& parent : parents) parent = one_of(half);
    Eigen::VectorXd x(n);
    for (Index k = 0; k < n; ++k) x(k) = people_(k, parents[static_cast<size_t>(one_of(n))]);
    return x;
  }

  void sort() {
    std::vector<Index> order(costs_.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](Index a, Index b) { return costs_[static_cast<size_t>(a)] < costs_[static_cast<size_t>(b)]; });
    const Eigen::MatrixXd people = people_;
    const std::vector<double> costs = costs_;
    for (size_t i = 0; i < order.size(); ++i) {
      people_.col(static_cast<Index>(i)) = people.col(order[i]);
      costs_[i] = costs[static_cast<size_t>(order[i])];
    }
  }

  SearchBudget& budget_;
  const EvolutionOptions& options_;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  std::normal_distribution<double> normal_{0, 1};
  Eigen::VectorXd first_low_, first_high_;  // in the unit box
  Eigen::MatrixXd people_;                  // parameters × individuals, best first
  std::vector<double> costs_;
};

}  // namespace

SearchResult evolve(const SearchProblem& problem, const SearchLimits& limits, const EvolutionOptions& options) {
  SearchBudget budget(problem, limits);
  Population population(budget, problem, options, limits.seed);
  population.found();
  double at_improvement = population.best();
  int since = 0;
  while (!budget.over()) {
    population.next_generation();
    if (options.variant == Variant::paper) continue;
    since = population.best() < (1 - options.least_improvement) * at_improvement ? 0 : since + 1;
    if (since == 0) at_improvement = population.best();
    if (since < options.patience || budget.over()) continue;
    population.found();
    at_improvement = population.best();
    since = 0;
  }
  return budget.result();
}

}  // namespace selvedge::estimate
