#include "diagnose/rows.h"

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
    inverse_sd_.segment(first(i), count(i)) =
        (objective.scenes()[i].trial.still ? std::sqrt(kStillSamples) : 1) / sd.array();
    const VectorXd time_s = objective.time_s(i);
    for (Index k = 0; k < time_s.size(); ++k)
      if (objective.is_skipped(i, time_s(k))) seen_(first(i) + k) = 0;
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

}  // namespace selvedge::diagnose
