#include "diagnose/linearisation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr const char* kOfGrid = "mesh_resolution";

double neutral_of(const model::Parameter& p) { return model::to_coordinate(p, p.start); }

// Columns and ways of all that a model may have; what they do is not known yet.
void list_columns(const Study& study, Linearisation& out) {
  for (size_t k = 0; k < study.base_count; ++k) {
    Column c;
    c.coordinate = static_cast<Index>(k);
    c.is_base = true;
    c.neutral = study.base(c.coordinate);
    c.sd = c.negligible_sd = study.protocol.base_sd;
    out.columns.push_back(c);
  }
  for (size_t e = 0; e < study.effects.size(); ++e) {
    const Effect& effect = study.effects[e];
    const auto add = [&](const model::Parameter& p, Index coordinate, double unit) {
      Column c;
      c.coordinate = coordinate;
      c.effect = e;
      c.neutral = coordinate < 0 ? 0 : neutral_of(p);
      const double origin = coordinate < 0 ? neutral_of(p) : 0;
      c.lower = (model::to_coordinate(p, p.lower) - origin) / unit;
      c.upper = (model::to_coordinate(p, p.upper) - origin) / unit;
      // What was measured before any physics tells how large it may be.
      c.scales = std::abs(unit);
      c.sd = std::max(study.protocol.effect_sd, coordinate < 0 ? 0 : std::abs(study.base(coordinate) - c.neutral)) /
             c.scales;
      out.columns.push_back(c);
      return static_cast<Index>(out.columns.size()) - 1;
    };
    if (effect.starts.empty()) {
      Way way{e, {}, {}};
      for (size_t k = 0; k < effect.parameters.size(); ++k)
        way.columns.push_back(add(effect.parameters[k], static_cast<Index>(study.first_parameter[e] + k), 1));
      out.ways.push_back(std::move(way));
    }
    for (const std::vector<double>& start : effect.starts) {
      VectorXd unit(static_cast<Index>(start.size()));
      for (size_t k = 0; k < start.size(); ++k)
        unit(static_cast<Index>(k)) = model::to_coordinate(effect.parameters[k], start[k]);
      const Index column = add(effect.parameters[0], -1, unit(0) - neutral_of(effect.parameters[0]));
      if (!effect.starts_add || out.ways.empty() || out.ways.back().effect != e) out.ways.push_back({e, {}, {}});
      out.ways.back().columns.push_back(column);
      out.ways.back().units.push_back(std::move(unit));
    }
  }
}

double negligible_mm(const Protocol& p, const Effect& effect) {
  return effect.applies_to == AppliesTo::images ? p.calibration_mm : p.negligible_mm;
}

// What is negligible of each effect, by its scale, by what another form of a law shows as it, and by what a unit of it
// leaves beyond a refit of the base. Of starts that add up that alone counts, shared among them: a scale of one leaves
// ten times what it does of another.
void set_negligible(const Study& study, Linearisation& out) {
  const Protocol& p = study.protocol;
  const auto n = static_cast<Index>(study.base_count);
  const MatrixXd beyond = BeyondBase(out.changes.leftCols(n)).of(out.changes);
  out.can_tell.assign(study.effects.size(), 0);
  for (size_t k = study.base_count; k < out.columns.size(); ++k) {
    Column& c = out.columns[k];
    const Effect& effect = study.effects[c.effect];
    const double trace_mm =
        beyond.col(static_cast<Index>(k)).norm() / std::sqrt(static_cast<double>(beyond.rows()));  // of a unit
    const double by_trace = negligible_mm(p, effect) / std::max(trace_mm, 1e-9);
    const double by_form = effect.form / effect.parameters[0].scale, share = std::max(p.negligible_share, by_form);
    const double sd = effect.starts_add ? by_trace / std::sqrt(static_cast<double>(effect.starts.size()))
                                        : std::max(share / c.scales, by_trace);
    if (sd < p.tells * c.sd) out.can_tell[c.effect] = 1;
    c.negligible_sd = std::min(sd, c.sd);
  }
}

// An effect of several parameters has directions that hardly show: a projector's shift along its rows is one across
// them by a hair. What leaves a trace of negligible_mm along one of these is negligible, too, however far it is: a
// column of its own, that is in every model.
void add_weak_directions(const Study& study, Linearisation& out) {
  const Protocol& p = study.protocol;
  const auto n = static_cast<Index>(study.base_count);
  const BeyondBase beyond(out.changes.leftCols(n));
  std::vector<VectorXd> weak;
  for (const Way& way : out.ways) {
    if (!way.units.empty() || way.columns.size() < 2) continue;
    const MatrixXd changes = out.changes(Eigen::all, way.columns), left = beyond.of(changes);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> directions(left.transpose() * left /
                                                             static_cast<double>(left.rows()));
    for (Index i = 0; i < changes.cols(); ++i) {
      const double trace_mm = std::sqrt(std::max(0.0, directions.eigenvalues()(i)));
      Column c;
      c.effect = way.effect;
      c.sd = p.effect_sd;
      c.negligible_sd = std::min(negligible_mm(p, study.effects[way.effect]) / std::max(trace_mm, 1e-9), p.effect_sd);
      if (c.negligible_sd <= p.negligible_share) continue;
      out.columns.push_back(c);
      weak.push_back(changes * directions.eigenvectors().col(i));
    }
  }
  const Index all = out.changes.cols();
  out.changes.conservativeResize(Eigen::NoChange, all + static_cast<Index>(weak.size()));
  for (size_t i = 0; i < weak.size(); ++i) out.changes.col(all + static_cast<Index>(i)) = weak[i];
}

// What a finer grid adds at x; nothing where a simulation diverged. residual: on the usual grid.
VectorXd grid_change(Study& study, const Windows& windows, const model::State& branches, const VectorXd& x,
                     const VectorXd& residual) {
  const model::State state = study.fine->state_of(*study.simulation, branches);
  const VectorXd change = windows.residuals(*study.fine, state, study.parameters, x).col(0) - residual;
  ++study.evaluations;
  return change.allFinite() ? change : VectorXd::Zero(residual.size());
}

}  // namespace

BeyondBase::BeyondBase(MatrixXd base) : base_(std::move(base)) {
  MatrixXd normal = base_.transpose() * base_;
  normal.diagonal().array() += 1e-9 * normal.trace();
  normal_.compute(normal);
}

MatrixXd BeyondBase::of(const MatrixXd& y) const { return y - base_ * normal_.solve(base_.transpose() * y); }

Prior prior_of(const Study& study, const Column& column, const VectorXd& x, Size size, double s) {
  constexpr double kNothing = 1e-6;
  if (column.is_force) return {0, s * study.protocol.lasting_share, -1e300, 1e300};
  const double here = column.coordinate < 0 ? 0 : x(column.coordinate);
  Prior prior{column.neutral - here, column.sd, -1e300, 1e300};
  if (column.is_base) return prior;
  if (size == Size::free) {
    prior.lower = column.lower - here;
    prior.upper = column.upper - here;
  } else {
    // Where something unknown is there, effects stand in for that with more than what is negligible.
    const Protocol& p = study.protocol;
    const double grows = std::max(1.0, s / (p.right_scale * p.unknown_over));
    prior.sd = size == Size::neutral ? kNothing : std::min(grows * column.negligible_sd, column.sd);
  }
  return prior;
}

VectorXd effect_at(const Study& study, const Way& way, const VectorXd& d) {
  const double neutral = neutral_of(study.effects[way.effect].parameters[0]);
  double sum = 0, weights = 0;
  VectorXd mean = VectorXd::Zero(way.units[0].size());
  for (size_t j = 0; j < way.columns.size(); ++j) {
    const double first = d(way.columns[j]) * (way.units[j](0) - neutral);
    sum += first;
    weights += std::abs(first);
    mean += std::abs(first) * way.units[j];
  }
  VectorXd out = weights > 0 ? VectorXd(mean / weights) : way.units[0];
  out(0) = neutral + sum;
  return out;
}

double deviation_at(const Study& study, const Way& way, const Posterior& posterior) {
  const double neutral = neutral_of(study.effects[way.effect].parameters[0]);
  VectorXd along = VectorXd::Zero(posterior.mean.size());
  for (size_t j = 0; j < way.columns.size(); ++j) along(way.columns[j]) = way.units[j](0) - neutral;
  return posterior.sd_along(along);
}

double grid_share(const Study& study, const VectorXd& x) {
  double share = 1;
  for (size_t e = 0; e < study.effects.size(); ++e)
    if (study.effects[e].name == kOfGrid)
      share += model::to_value(study.effects[e].parameters[0], x(static_cast<Index>(study.first_parameter[e])));
  return share;
}

model::State branches_at(const Study& study, model::State these, const VectorXd& x) {
  study.simulation->rematch(these, study.parameters, x);
  return these;
}

MatrixXd simulated(Study& study, const Windows& windows, const model::State& branches, const MatrixXd& sets, On on) {
  constexpr Index kAtOnce = 32;  // between two words of progress
  const model::Simulation& simulation = on == On::usual ? *study.simulation : *study.coarse;
  const model::State state = on == On::usual ? branches : study.coarse->state_of(*study.simulation, branches);
  study.evaluations += static_cast<int>(sets.cols());
  MatrixXd out;
  for (Index first = 0; first < sets.cols(); first += kAtOnce) {
    const Index count = std::min(kAtOnce, sets.cols() - first);
    const MatrixXd some = windows.residuals(simulation, state, study.parameters, sets.middleCols(first, count));
    if (first == 0) out.resize(some.rows(), sets.cols());
    out.middleCols(first, count) = some;
    if (sets.cols() > kAtOnce) study.on_share(static_cast<double>(first + count) / static_cast<double>(sets.cols()));
  }
  return out;
}

MatrixXd responses_to_forces(Study& study, const Windows& windows) {
  const auto count = static_cast<Index>(study.parameters.size() - study.first_force);
  MatrixXd sets = study.base.replicate(1, 1 + count);
  for (Index k = 0; k < count; ++k) sets(static_cast<Index>(study.first_force) + k, 1 + k) = 1;
  const MatrixXd r = simulated(study, windows, study.state, sets, On::coarse);
  MatrixXd out = r.rightCols(count).colwise() - r.col(0);
  for (Index k = 0; k < count; ++k)
    if (!out.col(k).allFinite()) out.col(k).setZero();
  return out;
}

Linearisation linearise(Study& study, const Windows& windows, const model::State& branches, const VectorXd& x,
                        const MatrixXd& forces, On on) {
  Linearisation out;
  out.x = x;
  out.branches = branches;
  list_columns(study, out);
  const auto n = static_cast<Index>(study.base_count), all = static_cast<Index>(out.columns.size());
  const double h = study.protocol.base_difference;
  // The base by central differences, effects by a finite change.
  MatrixXd sets = x.replicate(1, 1 + n + all);
  std::vector<double> step(static_cast<size_t>(all), 1);
  for (Index k = 0; k < n; ++k) {
    sets(k, 1 + k) += h;
    sets(k, 1 + all + k) -= h;
  }
  for (const Way& way : out.ways)
    for (size_t j = 0; j < way.columns.size(); ++j) {
      const Index k = way.columns[j];
      const Column& c = out.columns[static_cast<size_t>(k)];
      if (!way.units.empty()) {
        sets.col(1 + k).segment(static_cast<Index>(study.first_parameter[way.effect]), way.units[j].size()) =
            way.units[j];
      } else {
        if (x(c.coordinate) + 1 > c.upper) step[static_cast<size_t>(k)] = -1;
        sets(c.coordinate, 1 + k) += step[static_cast<size_t>(k)];
      }
    }
  const MatrixXd r = simulated(study, windows, branches, sets, on);
  out.residual = on == On::usual ? VectorXd(r.col(0)) : VectorXd(simulated(study, windows, branches, x).col(0));
  out.grid = grid_change(study, windows, branches, x, out.residual);
  out.changes.resize(r.rows(), all);
  for (Index k = 0; k < all; ++k) {
    if (k < n) out.changes.col(k) = (r.col(1 + k) - r.col(1 + all + k)) / (2 * h);
    else out.changes.col(k) = (r.col(1 + k) - r.col(0)) / step[static_cast<size_t>(k)];
    if (!out.changes.col(k).allFinite()) out.changes.col(k).setZero();
    const Column& c = out.columns[static_cast<size_t>(k)];
    if (!c.is_base && study.effects[c.effect].name == kOfGrid)
      out.changes.col(k) = study.effects[c.effect].parameters[0].scale * out.grid;
  }
  out.second = (r.middleCols(1, n) + r.middleCols(1 + all, n)).colwise() - 2 * r.col(0);
  out.second /= 2 * h * h;
  for (Index k = 0; k < n; ++k)
    if (!out.second.col(k).allFinite()) out.second.col(k).setZero();
  out.residual += grid_share(study, x) * out.grid;
  set_negligible(study, out);
  add_weak_directions(study, out);
  out.changes.conservativeResize(Eigen::NoChange, out.changes.cols() + forces.cols());
  out.changes.rightCols(forces.cols()) = forces;
  for (Index k = 0; k < forces.cols(); ++k) out.columns.emplace_back().is_force = true;
  return out;
}

}  // namespace selvedge::diagnose
