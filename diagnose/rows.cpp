#include "diagnose/rows.h"

#include <algorithm>
#include <cmath>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

Rows::Rows(const fit::Objective& objective) {
  offset_.push_back(0);
  for (size_t i = 0; i < objective.scenes().size(); ++i) offset_.push_back(offset_.back() + objective.sd_mm(i).size());
  inverse_sd_.resize(size());
  sd_mm_.resize(size());
  seen_ = VectorXd::Ones(size());
  for (size_t i = 0; i < trials(); ++i) {
    const VectorXd sd = objective.sd_mm(i);
    sd_mm_.segment(first(i), count(i)) = sd;
    inverse_sd_.segment(first(i), count(i)) = (objective.scenes()[i].trial.still ? std::sqrt(kStillSamples) : 1) / sd.array();
    const auto& markers = objective.scenes()[i].trial.markers;
    if (!markers) continue;
    for (Index k = 0; k < markers->position.cols(); ++k)
      if (!markers->position.col(k).allFinite()) seen_.segment(first(i) + 3 * k, 3).setZero();
  }
}

VectorXd Rows::whitened(const fit::Residuals& residuals) const {
  VectorXd out = VectorXd::Zero(size());
  for (size_t i = 0; i < trials(); ++i) {
    const VectorXd& mm = residuals.mm[i];
    for (Index k = 0; k < mm.size(); ++k) {
      const Index row = first(i) + k;
      out(row) = std::isfinite(mm(k)) ? mm(k) * inverse_sd_(row) : 0;
    }
  }
  return out;
}

double cauchy_cost(const VectorXd& r, double c) { return 0.5 * c * c * (1 + (r.array() / c).square()).log().sum(); }

VectorXd cauchy_weights(const VectorXd& r, double c) { return (1 / (1 + (r.array() / c).square())).matrix(); }

double robust_scale(const VectorXd& r) {
  std::vector<double> seen;
  for (const double x : r)
    if (x != 0) seen.push_back(std::abs(x));
  if (seen.empty()) return 1;
  std::nth_element(seen.begin(), seen.begin() + static_cast<std::ptrdiff_t>(seen.size() / 2), seen.end());
  return std::max(1.4826 * seen[seen.size() / 2], 1e-3);
}

}  // namespace selvedge::diagnose
