// One interface for every optimiser that needs costs alone: a box, a start, a function of batches, a budget.
//
// An optimiser asks for the costs of a batch of points and gets them together, so that simulations fill SIMD
// lanes and cores. All of them are deterministic: the same problem, limits and seed ask for the same points in the
// same order, which is what lets a journal (journal.h) resume them.
// Coordinates are those of the problem; inside, each optimiser works in the unit box.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "report/progress.h"

namespace selvedge::estimate {

// points: parameters × count. One cost a point; infinity where a point has none. A point's cost must not depend on
// the others of its batch.
using BatchCosts = std::function<std::vector<double>(const Eigen::MatrixXd& points)>;

struct SearchProblem {
  Eigen::VectorXd lower, upper;  // box, lower < upper
  Eigen::VectorXd start;         // in the box; where a search begins that begins somewhere
  BatchCosts costs;
};

struct SearchLimits {
  int evaluations = 600;                                        // at most
  double stop_cost = -std::numeric_limits<double>::infinity();  // a best cost at or below it ends the search
  unsigned seed = 1;
  report::ProgressCallback progress = [](double, const std::string&) {};
};

// After each batch.
struct SearchStep {
  int evaluations = 0;
  double best_cost = 0;
  double temperature = std::numeric_limits<double>::quiet_NaN();  // in units of cost; NaN where there is none
};

struct SearchResult {
  Eigen::VectorXd point;  // the best one
  double cost = std::numeric_limits<double>::infinity();
  int evaluations = 0;
  std::vector<SearchStep> trace;
  std::string ended;  // why: "evaluations spent", "cost reached", "converged"
};

}  // namespace selvedge::estimate
