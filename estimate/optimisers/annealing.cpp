#include "estimate/optimisers/annealing.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "estimate/optimisers/search_budget.h"

namespace selvedge::estimate {

namespace {

using Eigen::Index;

class Simplex {
 public:
  Simplex(SearchBudget& budget, unsigned seed)
      : budget_(budget), random_(seed), corners_(budget.parameters(), budget.parameters() + 1) {}

  // Around a point: one corner there, the others a step along each axis, inwards where the box ends.
  void build(const Eigen::VectorXd& centre, double edge) {
    for (Index k = 0; k < corners_.cols(); ++k) corners_.col(k) = centre;
    for (Index k = 0; k < centre.size(); ++k) corners_(k, k + 1) += centre(k) + edge > 1 ? -edge : edge;
    costs_ = budget_.costs(corners_);
  }

  double spread() const {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double c : costs_)
      if (std::isfinite(c)) {
        low = std::min(low, c);
        high = std::max(high, c);
      }
    return high > low ? high - low : 1;
  }

  // One move: reflect the worst corner; go on where that is the best, draw in where it is still the worst.
  void move(double temperature) {
    std::vector<double> felt(costs_.size());
    for (size_t k = 0; k < felt.size(); ++k) felt[k] = costs_[k] + fluctuation(temperature);
    const auto worst = std::max_element(felt.begin(), felt.end()) - felt.begin();
    const auto best = std::min_element(felt.begin(), felt.end()) - felt.begin();
    double second = -std::numeric_limits<double>::infinity();
    for (size_t k = 0; k < felt.size(); ++k)
      if (static_cast<Index>(k) != worst) second = std::max(second, felt[k]);
    double felt_worst = felt[static_cast<size_t>(worst)];
    const double reflected = replace(worst, -1, felt_worst, temperature);
    if (reflected <= felt[static_cast<size_t>(best)]) {
      replace(worst, 2, felt_worst, temperature);
    } else if (reflected >= second) {
      const double before = felt_worst;
      if (replace(worst, 0.5, felt_worst, temperature) >= before) draw_in(best);
    }
  }

 private:
  double fluctuation(double temperature) {
    const double u = std::max(uniform_(random_), 1e-300);
    return -temperature * std::log(u);
  }

  // Moves a corner by `factor` through the face opposite; kept where its felt cost is below felt_worst.
  double replace(Index corner, double factor, double& felt_worst, double temperature) {
    if (budget_.over()) return felt_worst;
    const auto n = static_cast<double>(corners_.rows());
    const Eigen::VectorXd others = corners_.rowwise().sum() - corners_.col(corner);
    const double share = (1 - factor) / n;
    const Eigen::VectorXd tried = (share * others + factor * corners_.col(corner)).cwiseMax(0.0).cwiseMin(1.0);
    const double cost = budget_.costs(tried).front(), felt = cost - fluctuation(temperature);
    if (felt < felt_worst) {
      corners_.col(corner) = tried;
      costs_[static_cast<size_t>(corner)] = cost;
      felt_worst = felt;
    }
    return felt;
  }

  void draw_in(Index best) {
    if (budget_.over()) return;
    const Eigen::VectorXd centre = corners_.col(best);
    Eigen::MatrixXd drawn(corners_.rows(), corners_.cols() - 1);
    for (Index k = 0, to = 0; k < corners_.cols(); ++k)
      if (k != best) drawn.col(to++) = 0.5 * (corners_.col(k) + centre);
    const std::vector<double> costs = budget_.costs(drawn);
    for (Index k = 0, from = 0; k < corners_.cols(); ++k)
      if (k != best) {
        corners_.col(k) = drawn.col(from);
        costs_[static_cast<size_t>(k)] = costs[static_cast<size_t>(from++)];
      }
  }

  SearchBudget& budget_;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  Eigen::MatrixXd corners_;  // parameters × corners, in the unit box
  std::vector<double> costs_;
};

}  // namespace

SearchResult anneal(const SearchProblem& problem, const SearchLimits& limits, const AnnealingOptions& options) {
  SearchBudget budget(problem, limits);
  Simplex simplex(budget, limits.seed);
  simplex.build(budget.unit_start(), options.edge);
  const double first = options.first_temperature > 0 ? options.first_temperature : 0.5 * simplex.spread();
  const double steps = std::log(options.last_temperature) / std::log(options.cooling);
  const int each = std::max(1, static_cast<int>(budget.left() / steps));  // evaluations a temperature
  double temperature = first, at_reset = first;
  while (!budget.over()) {
    budget.set_temperature(temperature);
    const int until = budget.left() - each;
    while (!budget.over() && budget.left() > until) simplex.move(temperature);
    temperature *= options.cooling;
    if (at_reset / temperature >= options.reset_factor && !budget.over()) {
      at_reset = temperature;
      simplex.build(budget.best_unit_point(), options.edge * std::sqrt(temperature / first));
    }
  }
  return budget.result();
}

}  // namespace selvedge::estimate
