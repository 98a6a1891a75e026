// Residuals of a campaign as one whitened column: r / sd, unseen samples zero, trial after trial.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "model/simulation.h"

namespace selvedge::estimate {

struct RowOptions {
  std::vector<size_t> trials;  // whose residuals are rows; empty: all
  double until_s = 1e300;      // later residuals of moving trials are none
};

class Rows {
 public:
  Rows(const model::Simulation& simulation, const RowOptions& options = {});

  Eigen::Index size() const { return inverse_sd_.size(); }

  // Trials that `residuals` has not: zero.
  Eigen::VectorXd whitened(const model::Residuals& residuals) const;
  // Of several sets, a column each; of NaN where a simulation diverged.
  Eigen::MatrixXd whitened(const std::vector<model::Residuals>& sets) const;
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
  Eigen::VectorXd inverse_sd_;
};

}  // namespace selvedge::estimate
