#include "estimate/robust_cost.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/order_statistics.h"

namespace selvedge::estimate {

using Eigen::VectorXd;

double robust_scale(const VectorXd& r) {
  std::vector<double> seen;
  for (const double x : r)
    if (x != 0) seen.push_back(std::abs(x));
  if (seen.empty()) return 1;
  return std::max(1.4826 * geometry::median(std::move(seen)), 1e-3);
}

double cauchy_cost(const VectorXd& r, double c) { return 0.5 * c * c * (1 + (r.array() / c).square()).log().sum(); }

VectorXd cauchy_weights(const VectorXd& r, double c) { return (1 / (1 + (r.array() / c).square())).matrix(); }

}  // namespace selvedge::estimate
