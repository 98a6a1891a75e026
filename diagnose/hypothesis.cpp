#include "diagnose/hypothesis.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include "estimate/descent.h"
#include "estimate/robust_cost.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

std::vector<size_t> all_trials(const Study& study) {
  std::vector<size_t> all(study.rows->trials());
  for (size_t i = 0; i < all.size(); ++i) all[i] = i;
  return all;
}

double bound(const model::Parameter& p, bool upper) { return model::to_coordinate(p, upper ? p.upper : p.lower); }

// Over h's active coordinates, by the rows of these trials (empty: all). The prior bends steps; what is left is judged
// without it.
estimate::DescentProblem problem_of(const Study& study, const Hypothesis& h, const std::vector<size_t>& trials) {
  const auto n = static_cast<Index>(h.active.size());
  estimate::DescentProblem out;
  out.prior_in_cost = false;
  out.cauchy = cauchy_constant(study);
  out.prior_centre = study.base(h.active);
  for (VectorXd* column : {&out.lower, &out.upper, &out.longest, &out.prior_weight}) column->resize(n);
  for (Index k = 0; k < n; ++k) {
    const Index coordinate = h.active[static_cast<size_t>(k)];
    const model::Parameter& p = study.parameters[static_cast<size_t>(coordinate)];
    out.lower(k) = model::to_coordinate(p, p.lower);
    out.upper(k) = model::to_coordinate(p, p.upper);
    out.longest(k) = coordinate < static_cast<Index>(study.base_count) ? 1 : std::numeric_limits<double>::infinity();
    out.prior_weight(k) = 1 / (p.prior_sd * p.prior_sd);
  }
  for (const size_t trial : trials) out.spans.push_back({study.rows->first(trial), study.rows->count(trial)});
  return out;
}

// Coordinates of all parameters where h's active ones are moved, a column each.
MatrixXd filled_in(const Hypothesis& h, const MatrixXd& active) {
  MatrixXd sets = h.x.replicate(1, active.cols());
  for (size_t k = 0; k < h.active.size(); ++k) sets.row(h.active[k]) = active.row(static_cast<Index>(k));
  return sets;
}

// Share of the weighted residual that `more` columns explain beyond `base` columns.
double gain_of(const MatrixXd& base, const MatrixXd& more, const VectorXd& r, const VectorXd& weights) {
  const VectorXd root = weights.cwiseSqrt();
  const MatrixXd j = root.asDiagonal() * base, e = root.asDiagonal() * more;
  const VectorXd wr = root.cwiseProduct(r);
  const MatrixXd ridge =
      1e-6 * (j.transpose() * j).trace() / static_cast<double>(j.cols()) * MatrixXd::Identity(j.cols(), j.cols());
  const auto solver = (j.transpose() * j + ridge).ldlt();
  const VectorXd left = wr - j * solver.solve(j.transpose() * wr);
  const MatrixXd own = e - j * solver.solve(j.transpose() * e);
  const VectorXd fitted = own.colPivHouseholderQr().solve(left);
  return 1 - (left - own * fitted).squaredNorm() / left.squaredNorm();
}

}  // namespace

std::string name_of(const Study& study, const Hypothesis& hypothesis) {
  std::string name;
  for (const size_t e : hypothesis.effects) name += (name.empty() ? "" : "+") + study.effects[e].name;
  return name.empty() ? "none" : name;
}

double cauchy_constant(const Study& study) { return estimate::kCauchy * estimate::robust_scale(study.residual); }

MatrixXd screen(Study& study, const Hypothesis& from, const std::vector<size_t>& effects) {
  const auto total = static_cast<Index>(study.parameters.size());
  // Both signs of what has two.
  std::vector<std::pair<Index, double>> probes;
  for (const size_t e : effects)
    for (size_t i = 0; i < study.effects[e].parameters.size(); ++i) {
      const auto k = static_cast<Index>(study.first_parameter[e] + i);
      probes.push_back({k, 1});
      if (bound(study.parameters[static_cast<size_t>(k)], false) <= from.x(k) - 1) probes.push_back({k, -1});
    }
  MatrixXd sets(total, static_cast<Index>(probes.size()));
  for (size_t i = 0; i < probes.size(); ++i) {
    sets.col(static_cast<Index>(i)) = from.x;
    sets(probes[i].first, static_cast<Index>(i)) += probes[i].second;
  }
  const MatrixXd r = residuals_of(study, {from}, sets);
  study.evaluations += static_cast<int>(sets.cols());
  MatrixXd columns = MatrixXd::Constant(study.rows->size(), total, std::numeric_limits<double>::quiet_NaN());
  VectorXd count = VectorXd::Zero(total);
  for (size_t i = 0; i < probes.size(); ++i) {
    const auto [k, sign] = probes[i];
    const VectorXd slope = (r.col(static_cast<Index>(i)) - from.residual) / sign;
    if (!slope.allFinite()) continue;
    if (count(k) == 0) columns.col(k) = slope;
    else columns.col(k) = (columns.col(k) * count(k) + slope) / (count(k) + 1);
    ++count(k);
  }
  return columns;
}

Hypothesis base_hypothesis(const Study& study) {
  Hypothesis h;
  for (size_t k = 0; k < study.base_count; ++k) h.active.push_back(static_cast<Index>(k));
  h.x = study.base;
  h.residual = study.residual;
  h.jacobian = study.jacobian;
  h.cost = estimate::cauchy_cost(h.residual, cauchy_constant(study));
  return h;
}

Hypothesis make_hypothesis(Study& study, const Hypothesis& from, const std::vector<size_t>& effects,
                           const MatrixXd& columns) {
  Hypothesis h = from;
  h.effects = effects;
  const VectorXd weights = estimate::cauchy_weights(from.residual, cauchy_constant(study));
  MatrixXd own(study.rows->size(), 0);
  for (const size_t e : effects) {
    const Effect& effect = study.effects[e];
    const auto first = static_cast<Index>(study.first_parameter[e]),
               count = static_cast<Index>(effect.parameters.size());
    MatrixXd here = columns.middleCols(first, count);
    if (!effect.starts.empty()) {
      // The best of the starting points, with derivatives of every parameter there.
      MatrixXd sets(h.x.size(), static_cast<Index>(effect.starts.size()));
      for (Index i = 0; i < sets.cols(); ++i) {
        sets.col(i) = from.x;
        for (Index k = 0; k < count; ++k)
          sets(first + k, i) = model::to_coordinate(effect.parameters[static_cast<size_t>(k)],
                                                    effect.starts[static_cast<size_t>(i)][static_cast<size_t>(k)]);
      }
      const MatrixXd r = residuals_of(study, {from}, sets);
      Index best = 0;
      double most = -1;
      for (Index i = 0; i < sets.cols(); ++i) {
        if (!r.col(i).allFinite()) continue;
        const double gain = gain_of(from.jacobian, r.col(i) - from.residual, from.residual, weights);
        if (gain > most) {
          most = gain;
          best = i;
        }
      }
      MatrixXd around(h.x.size(), count);
      for (Index k = 0; k < count; ++k) {
        around.col(k) = sets.col(best);
        around(first + k, k) += k == 0 ? 1.0 : 0.3;
      }
      const MatrixXd moved = residuals_of(study, {from}, around);
      study.evaluations += static_cast<int>(sets.cols() + count);
      h.x = sets.col(best);
      h.residual = r.col(best);
      for (Index k = 0; k < count; ++k) here.col(k) = (moved.col(k) - h.residual) / (k == 0 ? 1.0 : 0.3);
    }
    const Index before = own.cols();
    own.conservativeResize(Eigen::NoChange, before + count);
    for (Index k = 0; k < count; ++k) {
      h.active.push_back(first + k);
      own.col(before + k) = here.col(k).allFinite() ? VectorXd(here.col(k)) : VectorXd::Zero(own.rows());
    }
  }
  h.screened_gain = gain_of(from.jacobian, own, from.residual, weights);
  h.jacobian.conservativeResize(Eigen::NoChange, h.jacobian.cols() + own.cols());
  h.jacobian.rightCols(own.cols()) = own;
  h.cost = estimate::cauchy_cost(h.residual, cauchy_constant(study));
  return h;
}

MatrixXd steps_from(const Study& study, const Hypothesis& h, const std::vector<size_t>& trials,
                    const std::vector<double>& dampings) {
  const estimate::DescentPoint at{h.x(h.active), h.residual, h.jacobian, h.cost};
  return filled_in(h, tries_from(problem_of(study, h, trials), at, dampings));
}

MatrixXd residuals_of(const Study& study, const std::vector<Hypothesis>& hypotheses, const MatrixXd& sets,
                      const std::vector<size_t>& trials) {
  MatrixXd r = residuals_at(study, sets, trials);
  const Index each = sets.cols() / static_cast<Index>(hypotheses.size());
  for (Index k = 0; k < r.cols(); ++k) {
    const VectorXd& offset = hypotheses[static_cast<size_t>(k / each)].mesh_offset;
    if (offset.size()) r.col(k) += offset;
  }
  return r;
}

void refine_mesh(Study& study, std::vector<Hypothesis>& hypotheses) {
  MatrixXd sets(study.base.size(), static_cast<Index>(hypotheses.size()));
  for (Index i = 0; i < sets.cols(); ++i) sets.col(i) = hypotheses[static_cast<size_t>(i)].x;
  const MatrixXd coarse = residuals_at(study, sets);
  const double c = cauchy_constant(study);
  study.evaluations += static_cast<int>(sets.cols());
  const std::vector<model::Residuals> fine = study.fine->evaluate(study.fine_state, study.parameters, sets);
  study.evaluations += static_cast<int>(sets.cols());
  for (Index i = 0; i < sets.cols(); ++i) {
    Hypothesis& h = hypotheses[static_cast<size_t>(i)];
    const auto own_mesh = [&](size_t e) { return study.effects[e].name == "mesh_resolution"; };
    if (std::any_of(h.effects.begin(), h.effects.end(), own_mesh) || !fine[static_cast<size_t>(i)].finite ||
        !coarse.col(i).allFinite())
      continue;
    h.mesh_offset = study.rows->whitened(fine[static_cast<size_t>(i)]) - coarse.col(i);
    for (size_t trial = 0; trial < study.rows->trials(); ++trial) {
      const Index first = study.rows->first(trial), count = study.rows->count(trial);
      const VectorXd sd = study.rows->sd_mm().segment(first, count);
      const VectorXd change = h.mesh_offset.segment(first, count).cwiseProduct(sd),
                     left = coarse.col(i).segment(first, count).cwiseProduct(sd);
      if (!is_mesh_correction(*study.simulation, study.protocol, trial, change, left))
        h.mesh_offset.segment(first, count).setZero();
    }
    h.residual = coarse.col(i) + h.mesh_offset;
    h.cost = estimate::cauchy_cost(h.residual, c);
  }
}

void relinearise(Study& study, std::vector<Hypothesis>& hypotheses) {
  const double base_step = study.protocol.base_step, effect_step = study.protocol.effect_step;
  Index columns = 0;
  for (const Hypothesis& h : hypotheses) columns += static_cast<Index>(h.active.size());
  MatrixXd sets(study.base.size(), columns);
  VectorXd steps(columns);
  Index at = 0;
  for (const Hypothesis& h : hypotheses)
    for (const Index k : h.active) {
      const bool of_base = k < static_cast<Index>(study.base_count);
      const double step = of_base ? base_step : effect_step;
      steps(at) = h.x(k) + step > bound(study.parameters[static_cast<size_t>(k)], true) ? -step : step;
      sets.col(at) = h.x;
      sets(k, at) += steps(at);
      ++at;
    }
  const MatrixXd r = residuals_at(study, sets);
  study.evaluations += static_cast<int>(columns);
  at = 0;
  for (Hypothesis& h : hypotheses) {
    const VectorXd here = h.mesh_offset.size() ? VectorXd(h.residual - h.mesh_offset) : h.residual;
    for (Index k = 0; k < static_cast<Index>(h.active.size()); ++k, ++at)
      if (r.col(at).allFinite()) h.jacobian.col(k) = (r.col(at) - here) / steps(at);
  }
}

void refit(Study& study, std::vector<Hypothesis>& hypotheses, int rounds, const std::vector<double>& dampings) {
  std::vector<estimate::DescentProblem> problems;
  std::vector<estimate::DescentPoint> at;
  for (Hypothesis& h : hypotheses) {
    problems.push_back(problem_of(study, h, all_trials(study)));
    at.push_back({h.x(h.active), std::move(h.residual), std::move(h.jacobian), h.cost});
  }
  const auto evaluate = [&](const std::vector<MatrixXd>& tries) {
    const auto each = static_cast<Index>(dampings.size());
    MatrixXd sets(study.base.size(), each * static_cast<Index>(tries.size()));
    for (size_t i = 0; i < tries.size(); ++i)
      sets.middleCols(each * static_cast<Index>(i), each) = filled_in(hypotheses[i], tries[i]);
    study.evaluations += static_cast<int>(sets.cols());
    return residuals_of(study, hypotheses, sets);
  };
  for (int round = 0; round < rounds; ++round)
    step(problems, at, dampings, evaluate, estimate::Learning::from_every_try);
  for (size_t i = 0; i < at.size(); ++i) {
    Hypothesis& h = hypotheses[i];
    h.x(h.active) = at[i].x;
    h.residual = std::move(at[i].residual);
    h.jacobian = std::move(at[i].jacobian);
    h.cost = at[i].cost;
  }
}

}  // namespace selvedge::diagnose
