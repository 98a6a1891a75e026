// How well each hypothesis predicts trials that it was not fitted to.
//
// Groups of trials (replicates together) are left out one at a time; every arm is refitted to the rest, one
// Gauss–Newton step from its fit to all, and then simulated. Nothing of a group reaches the parameters that
// predict it but through the place where the derivatives were taken.
#pragma once

#include <vector>

#include "diagnose/hypothesis.h"

namespace selvedge::diagnose {

struct HeldOut {
  Eigen::MatrixXd mm;                        // hypothesis × trial: root mean square, mm; NaN where it diverged
  std::vector<Eigen::MatrixXd> coordinates;  // a hypothesis: parameters × group, fitted without that group
  std::vector<Eigen::VectorXd> residual;     // a hypothesis: whitened, each trial as predicted without its group
};

HeldOut hold_out(Study& study, const std::vector<Hypothesis>& hypotheses);

// Root mean square of one trial's part of a whitened residual, mm, single samples cut at 6 robust deviations:
// distance of a marker in space, or of a stripe and outline point.
double trial_rms_mm(const Study& study, const Eigen::VectorXd& whitened, size_t trial);

// Over several trials, samples weighed alike.
double pooled_mm(const Study& study, const Eigen::VectorXd& mm_of_trial, const std::vector<size_t>& trials);

// Standard deviation of a figure by the jackknife. without: the figure with each group left out.
double jackknife_sd(const Eigen::VectorXd& without);

}  // namespace selvedge::diagnose
