#include "diagnose/arm.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

VectorXd clamped(const Study& study, const VectorXd& x) {
  const auto [lower, upper] = model::bounds_of(study.parameters);
  return x.cwiseMax(lower).cwiseMin(upper);
}

std::vector<Prior> priors_of(const Study& study, const Arm& arm, double s) {
  return priors_of(study, arm.columns, arm.x, arm.sizes, s);
}

// −2 ln of likelihood and prior where an arm stands, but for constants. What moves no coordinate is free.
double misfit(const Study& study, const Evidence& evidence, const Arm& arm, size_t scale) {
  if (!arm.residual.allFinite()) return std::numeric_limits<double>::infinity();
  const std::vector<Prior> all = priors_of(study, arm, evidence.error().scales[scale]);
  std::vector<Index> unmoved;
  std::vector<Prior> priors;
  double sum = 0;
  for (size_t k = 0; k < all.size(); ++k) {
    if (arm.columns[k].coordinate >= 0) {
      sum += all[k].mean * all[k].mean / (all[k].sd * all[k].sd);
    } else {
      unmoved.push_back(static_cast<Index>(k));
      priors.push_back(all[k]);
    }
  }
  const Gram gram = evidence.gram(arm.changes(Eigen::all, unmoved), arm.residual, scale);
  return sum - 2 * posterior(gram, priors).log_evidence;
}

VectorXd between(const Arm& from, const VectorXd& to) {
  VectorXd d = VectorXd::Zero(static_cast<Index>(from.columns.size()));
  for (size_t k = 0; k < from.columns.size(); ++k)
    if (const Index c = from.columns[k].coordinate; c >= 0) d(static_cast<Index>(k)) = to(c) - from.x(c);
  return d;
}

// Markers nudge all simulations, so that a place close by is simulated close by. Pictures do not.
bool is_nudged(const Study& study) { return has_markers(study.simulation->trials()); }

using SimulateAt = std::function<MatrixXd(const MatrixXd& sets)>;

// Towards where an arm is likeliest, no coordinate of the base further than this: one that data hardly determine would
// else hold back all others.
VectorXd step_within(const Study& study, const Evidence& evidence, const Arm& arm, size_t scale, double reach) {
  std::vector<Prior> priors = priors_of(study, arm, evidence.error().scales[scale]);
  for (size_t k = 0; k < priors.size(); ++k)
    if (arm.columns[k].is_base) {
      priors[k].lower = -reach;
      priors[k].upper = reach;
    }
  return posterior(evidence.gram(arm.changes, arm.residual, scale), priors).mean;
}

// The likeliest of these places, if it is likelier than where an arm stands. least: misfit() there; returns that of
// where it then stands.
double go_to_best(const Study& study, const Evidence& evidence, const SimulateAt& simulate_at, const MatrixXd& sets,
                  double least, Arm& arm, size_t scale) {
  const MatrixXd r = simulate_at(sets);
  Arm best = arm;
  for (Index s = 0; s < sets.cols(); ++s) {
    Arm there = arm;
    there.x = sets.col(s);
    there.residual = r.col(s);
    if (!there.residual.allFinite()) continue;
    // What the step really did corrects the derivatives along it (Broyden 1965).
    const VectorXd step = between(arm, there.x);
    if (step.squaredNorm() > 0)
      there.changes += (there.residual - arm.residual - arm.changes * step) * step.transpose() / step.squaredNorm();
    const double misses = misfit(study, evidence, there, scale);
    if (misses < least) {
      least = misses;
      best = std::move(there);
    }
  }
  arm = std::move(best);
  return least;
}

// One damped step towards where an arm is likeliest, shorter if it leads nowhere. whole: as far as a base may be from
// where it is looked for is tried, too.
double step(const Study& study, const Evidence& evidence, const SimulateAt& simulate_at, double least, bool whole,
            Arm& arm, size_t scale) {
  const std::vector<double> shares = {1, 0.5, 0.25};
  std::vector<double> reaches = {study.protocol.longest_step};
  if (is_nudged(study)) reaches.push_back(study.protocol.short_step);
  for (const double reach : reaches) {
    const VectorXd d = step_within(study, evidence, arm, scale, reach);
    MatrixXd sets(arm.x.size(), static_cast<Index>(shares.size()) + (whole ? 1 : 0));
    for (size_t s = 0; s < shares.size(); ++s) sets.col(static_cast<Index>(s)) = moved(study, arm, shares[s] * d);
    if (whole) sets.rightCols<1>() = moved(study, arm, posterior_of(study, evidence, arm, scale).mean);
    const double now = go_to_best(study, evidence, simulate_at, sets, least, arm, scale);
    if (now < least) return now;
    whole = false;
  }
  return least;
}

// Derivatives where an arm stands: by the base, and by the effects that it has.
void differentiate(const Study& study, const SimulateAt& simulate_at, Arm& arm) {
  constexpr double kOfEffects = 0.5;
  std::vector<Index> columns;
  for (size_t k = 0; k < arm.columns.size(); ++k)
    if (arm.columns[k].coordinate >= 0 && (arm.columns[k].is_base || arm.sizes[k] == Size::free))
      columns.push_back(static_cast<Index>(k));
  MatrixXd sets = arm.x.replicate(1, static_cast<Index>(columns.size()));
  std::vector<double> steps;
  for (size_t i = 0; i < columns.size(); ++i) {
    const Column& c = arm.columns[static_cast<size_t>(columns[i])];
    const double h = c.is_base ? study.protocol.base_difference : kOfEffects;
    steps.push_back(c.is_base || arm.x(c.coordinate) + h <= c.upper ? h : -h);
    sets(c.coordinate, static_cast<Index>(i)) += steps.back();
  }
  const MatrixXd r = simulate_at(sets);
  for (size_t i = 0; i < columns.size(); ++i) {
    const VectorXd change = (r.col(static_cast<Index>(i)) - arm.residual) / steps[i];
    if (change.allFinite()) arm.changes.col(columns[i]) = change;
  }
}

// Simulates an arm where it was moved to, or leaves it where `about` was found, if the whole step leads astray.
void begin(const Study& study, const Evidence& evidence, const Linearisation& about, const SimulateAt& simulate_at,
           Arm& arm, size_t scale) {
  Arm stays = arm;
  stays.x = about.x;
  stays.branches = about.branches;
  stays.residual = about.residual;
  arm.residual = simulate_at(arm.x).col(0);
  if (!(misfit(study, evidence, arm, scale) <= misfit(study, evidence, stays, scale))) arm = std::move(stays);
}

// Residuals with what a finer grid adds about this point.
MatrixXd with_finer(const Study& study, const Linearisation& about, const MatrixXd& sets, MatrixXd residuals) {
  for (Index k = 0; k < sets.cols(); ++k) residuals.col(k) += grid_share(study, sets.col(k)) * about.grid;
  return residuals;
}

enum class Derivatives : char { taken, as_they_are };

// Step by step to where an arm is likeliest, with derivatives taken anew for each step, or only corrected along it. By
// markers the first step has those of `about`.
void descend(const Study& study, const Evidence& evidence, const Linearisation& about, const SimulateAt& simulate_at,
             Arm& arm, size_t scale, Derivatives derivatives) {
  if (arm.x != about.x) begin(study, evidence, about, simulate_at, arm, scale);
  double last = misfit(study, evidence, arm, scale);
  for (long round = 0; round < study.protocol.most_rounds && arm.residual.allFinite(); ++round) {
    const bool by_about = round == 0 && is_nudged(study), anew = derivatives == Derivatives::taken;
    if (anew && !by_about) differentiate(study, simulate_at, arm);
    const double now = step(study, evidence, simulate_at, last, anew && by_about, arm, scale);
    if (last - now < 2 * study.protocol.moves_on) return;
    last = now;
    study.on_share(static_cast<double>(round + 1) / static_cast<double>(study.protocol.most_rounds));
  }
}

}  // namespace

bool holds(const std::vector<size_t>& list, size_t x) { return std::find(list.begin(), list.end(), x) != list.end(); }

std::string name_of(const Study& study, const std::vector<size_t>& effects) {
  std::string name;
  for (const size_t e : effects) name += (name.empty() ? "" : "+") + study.effects[e].name;
  return name.empty() ? "none" : name;
}

std::vector<Size> sizes_of(const Linearisation& about, const std::vector<const Way*>& chosen) {
  std::vector<Size> out(about.columns.size(), Size::negligible);
  for (const Way* way : chosen)
    for (const Index k : way->columns) out[static_cast<size_t>(k)] = Size::free;
  return out;
}

Arm arm_at(const Linearisation& about, const std::vector<const Way*>& chosen) {
  Arm arm;
  for (const Way* way : chosen) arm.effects.push_back(way->effect);
  arm.sizes = sizes_of(about, chosen);
  arm.columns = about.columns;
  arm.changes = about.changes;
  arm.x = about.x;
  arm.branches = about.branches;
  arm.residual = about.residual;
  arm.grid = about.grid;
  return arm;
}

VectorXd moved(const Study& study, const Arm& arm, const VectorXd& d) {
  VectorXd x = arm.x;
  for (size_t k = 0; k < arm.columns.size(); ++k) {
    const Column& c = arm.columns[k];
    const double by = d(static_cast<Index>(k)), most = study.protocol.base_sd;
    if (c.coordinate >= 0) x(c.coordinate) += c.is_base ? std::clamp(by, -most, most) : by;
  }
  return clamped(study, x);
}

VectorXd estimate_of(const Study& study, const Linearisation& about, const Arm& arm, const VectorXd& d) {
  VectorXd x = moved(study, arm, d);
  for (const Way& way : about.ways) {
    if (way.units.empty() || arm.sizes[static_cast<size_t>(way.columns[0])] != Size::free) continue;
    x.segment(static_cast<Index>(study.first_parameter[way.effect]), way.units[0].size()) = effect_at(study, way, d);
  }
  return clamped(study, x);
}

Posterior posterior_of(const Study& study, const Evidence& evidence, const Arm& arm, size_t scale) {
  return posterior_of(study, arm, evidence.gram(arm.changes, arm.residual, scale), evidence.error().scales[scale]);
}

Posterior posterior_of(const Study& study, const Arm& arm, const Gram& gram, double s) {
  return posterior(gram, priors_of(study, arm, s));
}

void approach(Study& study, const Windows& windows, const Evidence& evidence, const Linearisation& about, Arm& arm,
              size_t scale) {
  if (!is_nudged(study)) {  // a whole step may lead to other folds
    arm.x = moved(study, arm, posterior_of(study, evidence, arm, scale).mean);
    arm.branches = branches_at(study, about.branches, arm.x);
  }
  const VectorXd usual = about.residual - grid_share(study, about.x) * about.grid,
                 adds = usual - simulated(study, windows, about.branches, about.x, On::coarse).col(0);
  const auto simulate_at = [&](const MatrixXd& sets) {
    return with_finer(study, about, sets, simulated(study, windows, arm.branches, sets, On::coarse).colwise() + adds);
  };
  descend(study, evidence, about, simulate_at, arm, scale, Derivatives::taken);
}

void fit_arm(Study& study, const Windows& windows, const Evidence& evidence, const Linearisation& about, Arm& arm,
             size_t scale) {
  if (arm.x != about.x) arm.branches = branches_at(study, about.branches, arm.x);
  const auto simulate_at = [&](const MatrixXd& sets) {
    return with_finer(study, about, sets, simulated(study, windows, arm.branches, sets));
  };
  descend(study, evidence, about, simulate_at, arm, scale, Derivatives::as_they_are);
}

}  // namespace selvedge::diagnose
