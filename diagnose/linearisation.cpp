#include "diagnose/linearisation.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include <tbb/parallel_for.h>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Motion does not change where mass, stiffness, damping and drag grow alike. By finite changes it would, by what these
// miss and by folds that snap, and a mass_error was named for that.
VectorXd change_by_mass(const Study& study, const VectorXd& x, Index coordinate, const MatrixXd& changes) {
  const model::Parameter& factor = study.parameters[static_cast<size_t>(coordinate)];
  VectorXd out = VectorXd::Zero(changes.rows());
  for (size_t k = 0; k < study.base_count; ++k)
    if (const std::string& unit = study.parameters[k].unit;
        unit.find("kg") != std::string::npos || unit.find('N') != std::string::npos)
      out -= changes.col(static_cast<Index>(k));
  return factor.scale / (1 + model::to_value(factor, x(coordinate))) * out;
}

// Residuals, which the study does not count.
MatrixXd residuals_on(const Study& study, const Windows& windows, const model::State& branches, const MatrixXd& sets,
                      On on) {
  constexpr Index kAtOnce = 32;  // between two words of progress
  const model::Simulation& simulation = on == On::usual  ? *study.simulation
                                        : on == On::fine ? *study.fine
                                                         : *study.coarse;
  const model::State state = on == On::usual ? branches : simulation.state_of(*study.simulation, branches);
  MatrixXd out(windows.rows(), sets.cols());
  for (Index first = 0; first < sets.cols(); first += kAtOnce) {
    const Index count = std::min(kAtOnce, sets.cols() - first);
    out.middleCols(first, count) =
        windows.residuals(simulation, state, study.parameters, sets.middleCols(first, count));
    if (sets.cols() > kAtOnce) study.on_share(static_cast<double>(first + count) / static_cast<double>(sets.cols()));
  }
  return out;
}

// Side by side, for one set of few trials leaves a processor idle; ranks take one call at a time.
void at_once(const Study& study, const std::vector<std::function<void()>>& runs) {
  if (study.simulation->options().ranks) {
    for (const auto& run : runs) run();
  } else {
    tbb::parallel_for(
        size_t{0}, runs.size(), [&](size_t i) { runs[i](); }, tbb::simple_partitioner());
  }
}

// A set of coordinates at which a column is one unit of it from x, and that unit: the other way where there is no room.
double move_by(const Study& study, const Linearisation& about, const Way& way, size_t j, Eigen::Ref<VectorXd> x) {
  if (!way.units.empty()) {
    x.segment(static_cast<Index>(study.first_parameter[way.effect]), way.units[j].size()) = way.units[j];
    return 1;
  }
  const Column& c = about.columns[static_cast<size_t>(way.columns[j])];
  const double step = x(c.coordinate) + 1 > c.upper ? -1 : 1;
  x(c.coordinate) += step;
  return step;
}

// What is simulated for derivatives about x: x itself, the base to both sides, then these columns.
struct Sets {
  MatrixXd at;
  std::vector<Index> columns;
  std::vector<double> steps;  // of these
};

Sets sets_about(const Study& study, const Linearisation& about, const VectorXd& x, const std::vector<size_t>& effects) {
  const auto n = static_cast<Index>(study.base_count);
  Sets out{x.replicate(1, 1 + 2 * n + static_cast<Index>(about.columns.size())), {}, {}};
  for (Index k = 0; k < n; ++k) {
    out.at(k, 1 + k) += study.protocol.base_difference;
    out.at(k, 1 + n + k) -= study.protocol.base_difference;
  }
  Index next = 1 + 2 * n;
  for (const Way& way : about.ways) {
    if (std::find(effects.begin(), effects.end(), way.effect) == effects.end()) continue;
    if (study.effects[way.effect].change != Change::simulated) continue;
    for (size_t j = 0; j < way.columns.size(); ++j) {
      out.steps.push_back(move_by(study, about, way, j, out.at.col(next++)));
      out.columns.push_back(way.columns[j]);
    }
  }
  out.at.conservativeResize(Eigen::NoChange, next);
  return out;
}

// By the base central differences, by these effects those of a finite change; and all else that is of x.
void differentiate(Study& study, const Windows& windows, const model::State& branches, const VectorXd& x,
                   const std::vector<size_t>& effects, Linearisation& out) {
  const auto n = static_cast<Index>(study.base_count);
  const double h = study.protocol.base_difference;
  const Sets sets = sets_about(study, out, x, effects);
  MatrixXd r;
  VectorXd finer;
  at_once(study, {[&] { finer = residuals_on(study, windows, branches, x, On::fine); },
                  [&] { out.residual = residuals_on(study, windows, branches, x, On::usual); },
                  [&] { r = residuals_on(study, windows, branches, sets.at, On::coarse); }});
  study.evaluations += static_cast<int>(sets.at.cols()) + 2;
  const auto finite = [](const VectorXd& v) { return v.allFinite() ? v : VectorXd(VectorXd::Zero(v.size())); };
  out.x = x;
  out.branches = branches;
  // To trials that diverge on the finer grid it adds nothing.
  out.grid = (finer - out.residual).array().isFinite().select(finer - out.residual, 0);
  out.second.resize(r.rows(), n);
  for (Index k = 0; k < n; ++k) {
    const VectorXd up = r.col(1 + k), down = r.col(1 + n + k);
    out.changes.col(k) = finite((up - down) / (2 * h));
    out.second.col(k) = finite((up + down - 2 * r.col(0)) / (2 * h * h));
  }
  for (size_t i = 0; i < sets.columns.size(); ++i)
    out.changes.col(sets.columns[i]) = finite((r.col(1 + 2 * n + static_cast<Index>(i)) - r.col(0)) / sets.steps[i]);
  for (const Way& way : out.ways) {
    const Effect& effect = study.effects[way.effect];
    auto change = out.changes.col(way.columns[0]);
    if (effect.change == Change::of_grid) change = effect.parameters[0].scale * out.grid;
    if (effect.change == Change::of_mass)
      change = change_by_mass(study, x, out.columns[static_cast<size_t>(way.columns[0])].coordinate, out.changes);
  }
  out.residual += grid_share(study, x) * out.grid;
  set_negligible(study, out);
  add_weak_directions(study, out);
}

}  // namespace

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
    const double grows = std::max(1.0, s / (study.right_scale * p.unknown_over));
    prior.sd = size == Size::neutral ? kNothing : std::min(grows * column.negligible_sd, column.sd);
  }
  return prior;
}

std::vector<Prior> priors_of(const Study& study, const std::vector<Column>& columns, const VectorXd& x,
                             const std::vector<Size>& sizes, double s) {
  std::vector<Prior> out;
  for (size_t k = 0; k < sizes.size(); ++k) out.push_back(prior_of(study, columns[k], x, sizes[k], s));
  return out;
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
    if (study.effects[e].change == Change::of_grid)
      share += model::to_value(study.effects[e].parameters[0], x(static_cast<Index>(study.first_parameter[e])));
  return share;
}

model::State branches_at(const Study& study, model::State these, const VectorXd& x) {
  study.simulation->rematch(these, study.parameters, x);
  return these;
}

MatrixXd simulated(Study& study, const Windows& windows, const model::State& branches, const MatrixXd& sets, On on) {
  study.evaluations += static_cast<int>(sets.cols());
  return residuals_on(study, windows, branches, sets, on);
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
                        const MatrixXd& forces) {
  Linearisation out;
  list_columns(study, out);
  out.changes.resize(windows.rows(), static_cast<Index>(out.columns.size()));
  std::vector<size_t> effects(study.effects.size());
  std::iota(effects.begin(), effects.end(), 0);
  differentiate(study, windows, branches, x, effects, out);
  add_forces(forces, out);
  return out;
}

Linearisation linearise_again(Study& study, const Windows& windows, const model::State& branches, const VectorXd& x,
                              const Linearisation& before, const std::vector<size_t>& effects) {
  Linearisation out;
  list_columns(study, out);
  out.changes = before.changes.leftCols(static_cast<Index>(out.columns.size()));
  differentiate(study, windows, branches, x, effects, out);
  const auto forces = static_cast<Index>(study.parameters.size() - study.first_force);
  add_forces(before.changes.rightCols(forces), out);
  return out;
}

}  // namespace selvedge::diagnose
