#include "estimate/bounded_step.h"

#include <algorithm>
#include <vector>

#include <Eigen/Cholesky>

namespace selvedge::estimate {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd bounded_step(const MatrixXd& normal, const VectorXd& gradient, const VectorXd& low, const VectorXd& high) {
  const Index n = gradient.size();
  VectorXd step = VectorXd::Zero(n), fixed = VectorXd::Zero(n);
  std::vector<Index> free(static_cast<size_t>(n));
  for (Index k = 0; k < n; ++k) free[static_cast<size_t>(k)] = k;
  while (!free.empty()) {
    const VectorXd right = -(gradient + normal * fixed);
    const VectorXd solved = MatrixXd(normal(free, free)).ldlt().solve(VectorXd(right(free)));
    step(free) = solved;
    auto worst = free.end();
    double excess = 1e-9;
    for (auto k = free.begin(); k != free.end(); ++k)
      if (const double beyond = std::max(low(*k) - step(*k), step(*k) - high(*k)); beyond > excess) {
        excess = beyond;
        worst = k;
      }
    if (worst == free.end()) break;
    fixed(*worst) = step(*worst) = step(*worst) > high(*worst) ? high(*worst) : low(*worst);
    free.erase(worst);
  }
  return step;
}

}  // namespace selvedge::estimate
