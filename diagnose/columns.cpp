#include "diagnose/columns.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Eigenvalues>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

double negligible_mm(const Protocol& p, const Effect& effect) {
  return effect.applies_to == AppliesTo::images ? p.calibration_mm : p.negligible_mm;
}

}  // namespace

double neutral_of(const model::Parameter& p) { return model::to_coordinate(p, p.start); }

BeyondBase::BeyondBase(MatrixXd base) : base_(std::move(base)) {
  MatrixXd normal = base_.transpose() * base_;
  normal.diagonal().array() += 1e-9 * normal.trace();
  normal_.compute(normal);
}

MatrixXd BeyondBase::of(const MatrixXd& y) const { return y - base_ * normal_.solve(base_.transpose() * y); }

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
    // What the base's coordinates do alike is theirs: no trace of it is left to tell how much of it hardly shows.
    c.negligible_sd = std::min(effect.change == Change::of_mass ? share / c.scales : sd, c.sd);
  }
}

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

void add_forces(const MatrixXd& changes, Linearisation& out) {
  const Index first = out.changes.cols();
  out.changes.conservativeResize(Eigen::NoChange, first + changes.cols());
  out.changes.rightCols(changes.cols()) = changes;
  for (Index k = 0; k < changes.cols(); ++k) out.columns.emplace_back().is_force = true;
}

}  // namespace selvedge::diagnose
