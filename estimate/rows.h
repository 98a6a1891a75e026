// Residuals of a campaign as one whitened column: r / sd, unseen samples zero, trial after trial.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "model/simulation.h"

namespace selvedge::estimate {

struct RowOptions {
  std::vector<size_t> trials;  // whose residuals are rows; empty: all
  double until_s = 1e300;      // later residuals of moving trials are none
  // A still trial has one sample of each marker where a moving one has dozens that say nearly the same; its rows weigh
  // as much as so many of them.
  double still_samples = 1;
};

class Rows {
 public:
  Rows(const model::Simulation& simulation, const RowOptions& options = {});

  Eigen::Index size() const { return inverse_sd_.size(); }
  size_t trials() const { return offset_.size() - 1; }  // of the campaign; those without rows have none
  Eigen::Index first(size_t trial) const { return offset_[trial]; }
  Eigen::Index count(size_t trial) const { return offset_[trial + 1] - offset_[trial]; }

  // Trials that `residuals` has not: zero.
  Eigen::VectorXd whitened(const model::Residuals& residuals) const;
  // Of several sets, a column each; of NaN where a simulation diverged.
  Eigen::MatrixXd whitened(const std::vector<model::Residuals>& sets) const;
  // One where the sample was seen, zero elsewhere.
  const Eigen::VectorXd& seen() const { return seen_; }
  // Standard deviation of a row, mm, without the weight of still trials.
  const Eigen::VectorXd& sd_mm() const { return sd_mm_; }

  size_t trial(Eigen::Index row) const { return place_[static_cast<size_t>(row)].trial; }
  // Rows of one trial that lie within the same 0.2 s share a block: they err together.
  int block(Eigen::Index row) const { return place_[static_cast<size_t>(row)].block; }

 private:
  struct Place {
    size_t trial = 0;
    Eigen::Index index = 0;  // into the trial's residuals
    int block = 0;
  };
  std::vector<Place> place_;
  std::vector<Eigen::Index> offset_;
  Eigen::VectorXd inverse_sd_, sd_mm_, seen_;
};

}  // namespace selvedge::estimate
