#include "diagnose/held_out.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimate/robust_cost.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

std::vector<size_t> others(const Study& study, const std::vector<size_t>& left_out) {
  std::vector<size_t> rest;
  for (size_t i = 0; i < study.rows->trials(); ++i)
    if (std::find(left_out.begin(), left_out.end(), i) == left_out.end()) rest.push_back(i);
  return rest;
}

double still_weight(const Study& study, size_t trial) {
  return study.simulation->trials()[trial].still ? std::sqrt(study.protocol.still_samples) : 1;
}

// Each hypothesis fitted to some trials alone, from where it was fitted to all: one step.
MatrixXd fitted_to(const Study& study, const std::vector<Hypothesis>& hypotheses, const std::vector<size_t>& trials) {
  MatrixXd sets(study.base.size(), static_cast<Index>(hypotheses.size()));
  for (Index i = 0; i < sets.cols(); ++i)
    sets.col(i) = steps_from(study, hypotheses[static_cast<size_t>(i)], trials, {1e-3});
  return sets;
}

}  // namespace

double trial_rms_mm(const Study& study, const VectorXd& whitened, size_t trial) {
  const Index first = study.rows->first(trial), count = study.rows->count(trial);
  const VectorXd r = whitened.segment(first, count);
  if (!r.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  const double cut = study.protocol.sample_cut * estimate::robust_scale(r);
  double sum = 0, seen = 0;
  for (Index k = 0; k < count; ++k) {
    if (study.rows->seen()(first + k) == 0) continue;
    const double mm = std::clamp(r(k), -cut, cut) * study.rows->sd_mm()(first + k) / still_weight(study, trial);
    sum += mm * mm;
    ++seen;
  }
  return std::sqrt((study.simulation->trials()[trial].markers ? 3 : 1) * sum / std::max(seen, 1.0));
}

double pooled_mm(const Study& study, const VectorXd& mm_of_trial, const std::vector<size_t>& trials) {
  double sum = 0, weight = 0;
  for (const size_t t : trials) {
    const double n = study.rows->seen().segment(study.rows->first(t), study.rows->count(t)).sum();
    const double mm = mm_of_trial(static_cast<Index>(t));
    if (!std::isfinite(mm)) continue;
    sum += n * mm * mm;
    weight += n;
  }
  return std::sqrt(sum / std::max(weight, 1.0));
}

double jackknife_sd(const VectorXd& without) {
  const auto n = static_cast<double>(without.size());
  return std::sqrt((n - 1) / n * (without.array() - without.mean()).square().sum());
}

HeldOut hold_out(Study& study, const std::vector<Hypothesis>& hypotheses) {
  const auto count = static_cast<Index>(hypotheses.size()), groups = static_cast<Index>(study.groups.size());
  HeldOut out;
  out.mm =
      MatrixXd::Constant(count, static_cast<Index>(study.rows->trials()), std::numeric_limits<double>::quiet_NaN());
  out.coordinates.assign(hypotheses.size(), MatrixXd(study.base.size(), groups));
  out.residual.assign(hypotheses.size(), VectorXd::Zero(study.rows->size()));
  for (Index g = 0; g < groups; ++g) {
    const std::vector<size_t>& left_out = study.groups[static_cast<size_t>(g)];
    const std::vector<size_t> fitted = groups > 1 ? others(study, left_out) : left_out;
    const MatrixXd sets = fitted_to(study, hypotheses, fitted);
    for (Index i = 0; i < count; ++i) out.coordinates[static_cast<size_t>(i)].col(g) = sets.col(i);
    const MatrixXd r = residuals_of(study, hypotheses, sets, left_out);
    for (Index i = 0; i < count; ++i)
      for (const size_t t : left_out) {
        out.mm(i, static_cast<Index>(t)) = trial_rms_mm(study, r.col(i), t);
        out.residual[static_cast<size_t>(i)].segment(study.rows->first(t), study.rows->count(t)) =
            r.col(i).segment(study.rows->first(t), study.rows->count(t));
      }
  }
  study.evaluations += static_cast<int>(count);
  return out;
}

}  // namespace selvedge::diagnose
