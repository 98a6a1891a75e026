#include "diagnose/weighing.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

bool meet(const std::vector<size_t>& a, const std::vector<size_t>& b) {
  return std::any_of(a.begin(), a.end(), [&](size_t x) { return std::find(b.begin(), b.end(), x) != b.end(); });
}

std::vector<EffectSet>::const_iterator place_of(const std::vector<EffectSet>& sets,
                                                const std::vector<size_t>& effects) {
  return std::find_if(sets.begin(), sets.end(), [&](const EffectSet& s) { return s.effects == effects; });
}

// Moves a set of effects to where it is likeliest and takes derivatives there.
Linearisation linearised_at(Study& study, const Windows& windows, const Evidence& evidence, const Linearisation& about,
                            const EffectSet& set, const MatrixXd& forces) {
  Arm arm = arm_at(study, about, set.chosen, set.d);
  fit_arm(study, windows, evidence, about, arm, set.scale);
  Linearisation out = linearise(study, windows, branches_at(study, arm.branches, arm.x), arm.x, about.grid, forces);
  return out.residual.allFinite() ? out : about;
}

// Of the effects that were measured before any physics, one each.
std::vector<const Way*> ways_of_measured(const Study& study, const Linearisation& about) {
  std::vector<const Way*> out;
  for (const size_t e : measured_effects(study))
    out.push_back(&*std::find_if(about.ways.begin(), about.ways.end(), [e](const Way& w) { return w.effect == e; }));
  return out;
}

// Weighs all sets about the base, or again those that have an effect of the likeliest about that one.
void weigh_all(const Study& study, Weighing& out) {
  if (!out.there) out.sets = weigh_sets(study, *out.evidence, out.none);
  else
    for (const EffectSet& set : weigh_sets(study, *out.evidence, *out.there))
      if (const auto same = place_of(out.sets, set.effects); same != out.sets.end() && meet(set.effects, out.first))
        out.sets[static_cast<size_t>(same - out.sets.begin())] = set;
  out.verdict = judge(study, out.sets, out.evidence->error().scales, {});
}

}  // namespace

const Linearisation& Weighing::about(const std::vector<size_t>& effects) const {
  return there && meet(effects, first) ? *there : none;
}

const EffectSet& Weighing::set_of(const std::vector<size_t>& effects) const { return *place_of(sets, effects); }

Weighing weigh(Study& study, const Windows& windows, const WeighingOptions& options) {
  const auto begin = [&](double from, double to, const std::string& what) {
    options.begins(from, what);
    study.on_share = [=, &options](double share) { options.begins(from + (to - from) * share, what); };
  };
  begin(0, 0.37, "changing everything once");
  const VectorXd at_fit = simulated(study, windows, study.state, study.base).col(0);
  if (!at_fit.allFinite())
    throw std::runtime_error(fmt::format("{}: the base model diverges at its fitted parameters", study.campaign));
  const VectorXd grid = grid_change(study, windows, study.base, at_fit);
  const MatrixXd forces = responses_to_forces(study, windows, study.base, at_fit);
  const Linearisation at_base = linearise(study, windows, study.state, study.base, grid, forces);
  const FrameNoise frames = frame_noise(study.measured, *study.simulation, windows);
  const auto error_about = [&](const Linearisation& about) {
    return model_error(study.protocol, windows, forces, grid, about.second, frames);
  };
  const Evidence at_first(windows, error_about(at_base));
  options.ends("changing everything once");

  begin(0.37, 0.53, "the base with what is negligible of every effect");
  Weighing out;
  out.none = linearised_at(study, windows, at_first, at_base,
                           weigh_set(study, at_first, at_base, ways_of_measured(study, at_base)), forces);
  out.evidence.emplace(windows, error_about(out.none));
  weigh_all(study, out);
  options.ends("the base where it is likeliest");

  out.first = out.verdict.weights.front().effects;
  if (!out.first.empty()) {
    begin(0.53, 1, "again about " + name_of(study, out.first));
    out.there = linearised_at(study, windows, *out.evidence, out.none, out.set_of(out.first), forces);
    weigh_all(study, out);
    options.ends("again about the likeliest set");
  }
  study.on_share = [](double) {};
  return out;
}

}  // namespace selvedge::diagnose
