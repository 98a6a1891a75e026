// What a model predicts a short time ahead: held near the markers for a while, then free for a while, and so on.
//
// A motion that runs free for seconds leaves the recorded folds, and what it does then tells nothing of its forces. So
// a trial of markers is simulated twice under a schedule, held where the other is free, and what the free parts leave
// are the rows: no hold acts in them, and what the hold left them is part of their error. A piece that is led in is
// held while it is. Trials without markers run free from rest, still ones hang.
//
// Rows are mm, window after window; those of one window err together, those of two do not.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "diagnose/protocol.h"
#include "model/simulation.h"

namespace selvedge::diagnose {

struct Window {
  size_t trial = 0;
  double from_s = 0, to_s = 0;  // of the trial's own time
  Eigen::Index first = 0, count = 0;
};

class Windows {
 public:
  // Of markers that were never seen there are no rows.
  Windows(const model::Simulation& simulation, const Protocol& protocol);

  Eigen::Index rows() const { return static_cast<Eigen::Index>(slices_.size()); }
  const std::vector<Window>& windows() const { return windows_; }
  // The place of a row in its trial's residuals (model::Residuals::mm).
  Eigen::Index place(Eigen::Index row) const { return slices_[static_cast<size_t>(row)].place; }
  size_t trial(Eigen::Index row) const { return slices_[static_cast<size_t>(row)].trial; }
  // Standard deviation of each row by the sensor alone, mm.
  const Eigen::VectorXd& noise_mm() const { return noise_mm_; }

  // The runs of a trial, two where it is held by turns and else one: `state` held as in the first or the second, and in
  // which of them a trial is free at a time.
  int phases(const model::ObservedTrial& trial) const { return is_held(trial) ? kPhases : 1; }
  model::State held(const model::Simulation& simulation, const model::State& state, int phase) const;
  int phase_at(const model::ObservedTrial& trial, double t_s) const;

  // Residuals at coordinate sets (columns), on this simulation or one of another grid over the same trials. state: its
  // branches. NaN in the rows of a trial whose simulation diverged.
  Eigen::MatrixXd residuals(const model::Simulation& simulation, const model::State& state,
                            const std::vector<model::Parameter>& parameters, const Eigen::MatrixXd& coordinates) const;

 private:
  static constexpr int kPhases = 2;
  // Where a row is simulated, and in which of the two runs of its trial.
  struct Slice {
    Eigen::Index place = 0;
    size_t trial = 0;
    int phase = 0;
  };
  bool is_held(const model::ObservedTrial& trial) const { return trial.markers && !trial.still; }

  Protocol protocol_;
  std::vector<Window> windows_;
  std::vector<Slice> slices_;  // one a row
  Eigen::VectorXd noise_mm_;
};

}  // namespace selvedge::diagnose
