#include "diagnose/weighing.h"

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "diagnose/window_errors.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

bool meet(const std::vector<size_t>& a, const std::vector<size_t>& b) {
  return std::any_of(a.begin(), a.end(), [&](size_t x) { return holds(b, x); });
}

std::vector<EffectSet>::const_iterator place_of(const std::vector<EffectSet>& sets,
                                                const std::vector<size_t>& effects) {
  return std::find_if(sets.begin(), sets.end(), [&](const EffectSet& s) { return s.effects == effects; });
}

// The effects whose derivatives are taken again where an arm of a set stands: its own, and as many as there is room for
// of those that are likeliest beside it by the derivatives that there are.
std::vector<size_t> taken_again(const Study& study, const Evidence& evidence, const Linearisation& about,
                                const EffectSet& set, const Arm& arm) {
  Linearisation there = about;
  there.x = arm.x;
  there.residual = arm.residual;
  there.changes = arm.changes;
  std::vector<Index> columns(study.effects.size(), 0);
  for (const Way& way : about.ways) columns[way.effect] += static_cast<Index>(way.columns.size());
  std::vector<size_t> out = set.effects;
  Index room = study.protocol.columns_again;
  for (const size_t e : out) room -= columns[e];
  for (const size_t e : likeliest_beside(study, evidence, there, set.chosen)) {
    if (columns[e] > room) continue;
    room -= columns[e];
    out.push_back(e);
  }
  return out;
}

// Moves a set of effects to where it is likeliest and takes derivatives there.
Linearisation linearised_at(Study& study, const Windows& windows, const Evidence& evidence, const Linearisation& about,
                            const EffectSet& set) {
  const std::function<void(double)> on_share = study.on_share;
  const auto from = [&](double begin, double end) {
    study.on_share = [=](double share) { on_share(begin + (end - begin) * share); };
  };
  Arm arm = arm_at(about, set.chosen);
  from(0, 0.4);
  approach(study, windows, evidence, about, arm, set.scale);
  from(0.4, 0.7);
  fit_arm(study, windows, evidence, about, arm, set.scale);
  from(0.7, 1);
  Linearisation out = linearise_again(study, windows, branches_at(study, arm.branches, arm.x), arm.x, about,
                                      taken_again(study, evidence, about, set, arm));
  study.on_share = on_share;
  return out.residual.allFinite() ? out : about;
}

// Of the effects that the base is found with, one each.
std::vector<const Way*> ways_found_with_base(const Study& study, const Linearisation& about) {
  std::vector<const Way*> out;
  for (const size_t e : found_with_base(study))
    out.push_back(&*std::find_if(about.ways.begin(), about.ways.end(), [e](const Way& w) { return w.effect == e; }));
  return out;
}

// Whether the base was moved with all of these effects: then it stands where they are likeliest.
bool is_moved_with_base(const Study& study, const std::vector<size_t>& effects) {
  const std::vector<size_t> with = found_with_base(study);
  return std::all_of(effects.begin(), effects.end(), [&](size_t e) { return holds(with, e); });
}

// All sets about the base.
void weigh_all(const Study& study, Weighing& out) {
  out.sets = weigh_sets(study, *out.evidence, out.none);
  out.verdict = judge(study, out.sets, out.evidence->error().scales, {});
}

// Of a set's evidence, at its likeliest s.
double most_of(const Study& study, const Evidence& evidence, const EffectSet& set) {
  const ScalePriors priors = scale_priors(study, evidence.error().scales);
  double most = -1e300;
  for (size_t s = 0; s < set.log_evidence.size(); ++s)
    most = std::max(most, set.log_evidence[s] + std::max(priors.right[s], priors.unknown[s]));
  return most;
}

// Those that have an effect of the likeliest as they were weighed about that one, the others about the base. The
// evidence of one model differs by some nats from point to point, so what a set gains on none counts as far as both
// points bear it out, or as it is more than that.
void take_those_that_meet(const Study& study, const std::vector<EffectSet>& about_first, Weighing& out) {
  const Evidence& evidence = *out.evidence;
  const double none = most_of(study, evidence, out.set_of({})),
               none_there = most_of(study, evidence, *place_of(about_first, {}));
  for (EffectSet set : about_first) {
    const auto same = place_of(out.sets, set.effects);
    if (same == out.sets.end() || !meet(set.effects, out.first)) continue;
    const double there = most_of(study, evidence, set), gain = most_of(study, evidence, *same) - none,
                 borne_out = none + std::min(gain, there - none_there);
    const double counts = std::max(borne_out, there - study.protocol.point_nats);
    for (double& l : set.log_evidence) l += counts - there;
    out.sets[static_cast<size_t>(same - out.sets.begin())] = std::move(set);
  }
  out.verdict = judge(study, out.sets, out.evidence->error().scales, {});
}

// The set that is looked at where it stands: the likeliest, or where that has no effect the one that gains most on
// none. About the base derivatives may promise less than there is.
std::vector<size_t> leader(const Study& study, const Weighing& out) {
  const std::vector<size_t>& likeliest = out.verdict.weights.front().effects;
  if (!likeliest.empty()) return likeliest;
  double most = most_of(study, *out.evidence, out.set_of({})) + study.protocol.looks_at;
  std::vector<size_t> best;
  for (const EffectSet& set : out.sets)
    if (const double here = most_of(study, *out.evidence, set); set.effects.size() == 1 && here > most) {
      most = here;
      best = set.effects;
    }
  return best;
}

// Whether the likeliest set is likelier where it was moved to than none is. Derivatives may promise what is not there,
// and the way may end where all sets are worse than none is elsewhere.
bool has_arrived(const Study& study, const Weighing& out, const std::vector<EffectSet>& about_first) {
  const auto moved = place_of(about_first, out.first);
  return moved != about_first.end() &&
         most_of(study, *out.evidence, *moved) > most_of(study, *out.evidence, out.set_of({}));
}

// The base without effects from where the likeliest set stands: the way there may have led out of a valley that only
// derivatives of the first one see. Where it did, all sets are weighed about that base, for a point further down is
// worth more than an effect. False where it did not. from_there: the base weighed there.
bool again_without(Study& study, const Windows& windows, const EffectSet& from_there, Weighing& out) {
  const Evidence& evidence = *out.evidence;
  const double now = most_of(study, evidence, out.set_of({}));
  if (most_of(study, evidence, from_there) < now + study.protocol.point_nats) return false;
  Linearisation again = linearised_at(study, windows, evidence, *out.there, from_there);
  if (most_of(study, evidence, weigh_set(study, evidence, again, {})) <= now) return false;
  out.none = std::move(again);
  out.there.reset();
  weigh_all(study, out);
  return true;
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
  begin(0, 0.18, "changing everything once");
  const MatrixXd forces = responses_to_forces(study, windows);
  const Linearisation at_base = linearise(study, windows, study.state, study.base, forces);
  if (!at_base.residual.allFinite())
    throw std::runtime_error(fmt::format("{}: the base model diverges at its fitted parameters", study.campaign));
  const FrameNoise frames = frame_noise(study.measured, *study.simulation, windows);
  const auto error_about = [&](const Linearisation& about) {
    return model_error(study.protocol, windows, forces, about.grid,
                       seen_error(study.protocol, *study.simulation, windows, about.grid), about.second, frames);
  };
  const Evidence at_first(windows, by_windows(study, windows, at_base, error_about(at_base)));
  options.ends("changing everything once");

  begin(0.18, 0.58, "the base with what is negligible of every effect");
  Weighing out;
  out.none = linearised_at(study, windows, at_first, at_base,
                           weigh_set(study, at_first, at_base, ways_found_with_base(study, at_base)));
  out.evidence.emplace(windows, by_windows(study, windows, out.none, error_about(out.none)));
  weigh_all(study, out);
  options.ends("the base where it is likeliest");

  for (long valley = 0; valley < study.protocol.valleys; ++valley) {
    out.first = leader(study, out);
    if (out.first.empty() || is_moved_with_base(study, out.first)) break;
    const double share = 0.42 / static_cast<double>(study.protocol.valleys),
                 from = 0.58 + share * static_cast<double>(valley);
    begin(from, from + share, "again about " + name_of(study, out.first));
    out.there = linearised_at(study, windows, *out.evidence, out.none, out.set_of(out.first));
    const std::vector<EffectSet> about_first = weigh_sets(study, *out.evidence, *out.there);
    if (!has_arrived(study, out, about_first)) {
      out.there.reset();
      break;
    }
    if (again_without(study, windows, *place_of(about_first, {}), out)) continue;
    take_those_that_meet(study, about_first, out);
    break;
  }
  if (!out.first.empty()) options.ends("again about the likeliest set");
  study.on_share = [](double) {};
  return out;
}

}  // namespace selvedge::diagnose
