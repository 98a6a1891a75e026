// Residuals of a whole campaign as one whitened column: r / sd, unseen samples zero, trial after trial.
//
// A still trial has one sample of each marker where a moving one has dozens that say nearly the same; its rows
// weigh as much as kStillSamples of them.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "fit/objective.h"

namespace selvedge::diagnose {

inline constexpr double kSampleCut =
    6;  // robust standard deviations of a trial's residual, at which single samples of an error are cut
inline constexpr double kStillSamples = 6;

class Rows {
 public:
  explicit Rows(const fit::Objective& objective);

  Eigen::Index size() const { return offset_.back(); }
  size_t trials() const { return offset_.size() - 1; }
  Eigen::Index first(size_t trial) const { return offset_[trial]; }
  Eigen::Index count(size_t trial) const { return offset_[trial + 1] - offset_[trial]; }

  // Trials that `residuals` has not: zero.
  Eigen::VectorXd whitened(const fit::Residuals& residuals) const;
  // One where the sample was seen, zero elsewhere.
  const Eigen::VectorXd& seen() const { return seen_; }
  // Standard deviation of a row, mm, without the weight of still trials.
  const Eigen::VectorXd& sd_mm() const { return sd_mm_; }

 private:
  std::vector<Eigen::Index> offset_;
  Eigen::VectorXd inverse_sd_, sd_mm_, seen_;
};

}  // namespace selvedge::diagnose
