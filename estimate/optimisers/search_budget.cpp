#include "estimate/optimisers/search_budget.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace selvedge::estimate {

SearchBudget::SearchBudget(const SearchProblem& problem, const SearchLimits& limits)
    : problem_(problem), limits_(limits) {
  const bool fits = problem.upper.size() == problem.lower.size() && problem.start.size() == problem.lower.size();
  if (!fits || problem.lower.size() == 0 || !(problem.lower.array() < problem.upper.array()).all())
    throw std::invalid_argument("SearchBudget: the box is empty");
  if (!(problem.start.array() >= problem.lower.array()).all() ||
      !(problem.start.array() <= problem.upper.array()).all())
    throw std::invalid_argument("SearchBudget: the start lies outside the box");
  result_.point = problem.start;
  best_unit_ = unit_start();
}

Eigen::VectorXd SearchBudget::unit_start() const {
  return (problem_.start - problem_.lower).cwiseQuotient(problem_.upper - problem_.lower);
}

std::vector<double> SearchBudget::costs(const Eigen::MatrixXd& unit_points) {
  const Eigen::Index count = std::min<Eigen::Index>(unit_points.cols(), std::max(left(), 0));
  std::vector<double> all(static_cast<size_t>(unit_points.cols()), std::numeric_limits<double>::infinity());
  if (count == 0) return all;
  const Eigen::MatrixXd points =
      ((unit_points.leftCols(count).array().colwise() * (problem_.upper - problem_.lower).array()).matrix().colwise() +
       problem_.lower);
  const std::vector<double> costs = problem_.costs(points);
  if (costs.size() != static_cast<size_t>(count))
    throw std::logic_error("SearchBudget: as many costs as points are due");
  for (Eigen::Index i = 0; i < count; ++i) {
    const double cost = costs[static_cast<size_t>(i)];
    if (std::isnan(cost)) continue;
    all[static_cast<size_t>(i)] = cost;
    if (cost >= result_.cost) continue;
    result_.cost = cost;
    result_.point = points.col(i);
    best_unit_ = unit_points.col(i);
  }
  result_.evaluations += static_cast<int>(count);
  result_.trace.push_back({result_.evaluations, result_.cost, temperature_});
  limits_.progress(static_cast<double>(result_.evaluations) / limits_.evaluations,
                   fmt::format("best cost {:.5g} after {} evaluations", result_.cost, result_.evaluations));
  return all;
}

bool SearchBudget::over() const { return left() <= 0 || result_.cost <= limits_.stop_cost; }

SearchResult SearchBudget::result(const std::string& otherwise) const {
  SearchResult out = result_;
  out.ended = out.cost <= limits_.stop_cost ? "cost reached" : left() <= 0 ? "evaluations spent" : otherwise;
  return out;
}

}  // namespace selvedge::estimate
