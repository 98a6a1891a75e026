// From held-out errors to probabilities over {none, every effect, unknown}.
//
// Every hypothesis h is scored by how much better than the base it predicts groups of trials that it was not
// fitted to, each group speaking once, however long it is. Of a group's mean square the sensor's noise n² is taken off,
// and f², what the form of a right model leaves, is added, so that nothing can win by less than that:
//   e_h = max(m_h² − n², 0) + f²,   L_h = mean over groups of ln(e_base / e_h),   score_h = κ L_h − c · parameters + ln
//   prior.
// The largest and the smallest of four groups or more are left out: one trial that takes another fold proves nothing.
// `unknown` stands for an effect that would explain the gap down to what a right one leaves,
//   m² = n² + f² + (form share)² · (m_base² − n²),   at a cost c_unknown.
// `none` loses ln(p / 0.05) where a null campaign would show such a gap with a probability p below that.
// So a name wins where it explains the gap about as well as any right answer could; unknown where a gap is
// plain and no effect closes it; none where nothing predicts better than the base, and no gap is plain.
// f² = form² + (mesh share · what the last refinement changed)². Samples of one motion err together, so κ is not their
// number.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "diagnose/held_out.h"
#include "diagnose/protocol.h"

namespace selvedge::diagnose {

double size_form_share(const Protocol& protocol, Side side);

struct Floor {
  Eigen::VectorXd noise_mm;  // a trial: sensor noise alone
  Eigen::VectorXd right_mm;  // a trial: what a right model leaves, f
  double replicate_mm = 0;   // half the difference of replicates' residuals; NaN without replicates
};

// Sensor noise of a trial of markers as it was stated, mm in space.
double marker_noise_mm(const model::ObservedTrial& trial);

Floor floor_of(const Study& study, const Protocol& protocol);

struct Scores {
  std::vector<double> log_ratio;  // L of each hypothesis
  double log_ratio_unknown = 0;
  double log_ratio_right = 0;  // of a model that leaves right_mm
  // "none", "unknown", and every effect of the study; adds up to 1. What two effects have together is shared by them,
  // half and half.
  std::map<std::string, double> probability;
  std::map<std::string, double> of_two;  // "a+b": of this, what two effects have together
  std::string likeliest;                 // of all, pairs among them
  double p_value = 1;                    // of the gap
};

// hypotheses: base first; of one effect or two. Effects that are in none of them count as explaining nothing, and so do
// pairs.
Scores score(const Study& study, const std::vector<Hypothesis>& hypotheses, const HeldOut& held_out, const Floor& floor,
             const Protocol& protocol);

// One number a group: pooled root mean square of its trials.
std::vector<double> group_mm(const Study& study, const Eigen::VectorXd& mm_of_trial);

}  // namespace selvedge::diagnose
