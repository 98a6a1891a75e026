// What all optimisers share: costs in the unit box, the budget, the best point so far, the trace.
#pragma once

#include "estimate/optimisers/search.h"

namespace selvedge::estimate {

class SearchBudget {
 public:
  // Throws std::invalid_argument where the box is empty or the start lies outside it.
  SearchBudget(const SearchProblem& problem, const SearchLimits& limits);

  // Costs of points of the unit box. Those beyond the budget are not evaluated and cost infinity.
  std::vector<double> costs(const Eigen::MatrixXd& unit_points);

  Eigen::VectorXd unit_start() const;
  Eigen::Index parameters() const { return problem_.lower.size(); }
  int left() const { return limits_.evaluations - result_.evaluations; }
  bool over() const;
  double best_cost() const { return result_.cost; }
  const Eigen::VectorXd& best_unit_point() const { return best_unit_; }

  void set_temperature(double temperature) { temperature_ = temperature; }
  // The result; `otherwise` says why it ended where neither budget nor cost did.
  SearchResult result(const std::string& otherwise = "converged") const;

 private:
  const SearchProblem& problem_;
  const SearchLimits& limits_;
  SearchResult result_;
  Eigen::VectorXd best_unit_;
  double temperature_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace selvedge::estimate
