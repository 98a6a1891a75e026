#include "cloth/quasi_newton.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace selvedge::cloth {

using Eigen::VectorXd;

double longest(const VectorXd& step) {
  return std::sqrt(step.reshaped(3, step.size() / 3).colwise().squaredNorm().maxCoeff());
}

VectorXd StepMemory::direction(const ForceOf& guess, const VectorXd& force) const {
  VectorXd q = force;
  std::vector<double> alpha(pairs_.size());
  for (size_t i = pairs_.size(); i-- > 0;) {
    alpha[i] = pairs_[i].inverse * pairs_[i].moved.dot(q);
    q -= alpha[i] * pairs_[i].changed;
  }
  VectorXd r = guess(q);
  for (size_t i = 0; i < pairs_.size(); ++i)
    r += (alpha[i] - pairs_[i].inverse * pairs_[i].changed.dot(r)) * pairs_[i].moved;
  return r;
}

void StepMemory::remember(VectorXd moved, VectorXd changed) {
  constexpr size_t memory = 16;
  const double curvature = moved.dot(changed);
  if (!(curvature > 1e-8 * moved.norm() * changed.norm())) return;
  pairs_.push_back({std::move(moved), std::move(changed), 1 / curvature});
  if (pairs_.size() > memory) pairs_.pop_front();
}

SearchedStep search_along(const VectorXd& x, const VectorXd& p, double push, double longest_m,
                          const ForceOf& force_at) {
  constexpr int most_tries = 4;
  constexpr double share_left = 0.9;  // of the push, at the end of a step
  double share = std::min(1.0, longest_m / longest(p));
  SearchedStep there;
  for (int t = 0; t < most_tries; ++t) {
    there.x = x + share * p;
    there.force = force_at(there.x);
    const double left = there.force.allFinite() ? p.dot(there.force) : -1e9 * push;
    if (left > -share_left * push) break;
    share *= std::clamp(push / (push - left), 0.1, 0.6);
  }
  return there;
}

}  // namespace selvedge::cloth
