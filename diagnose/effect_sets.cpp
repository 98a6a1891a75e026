#include "diagnose/effect_sets.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <tbb/parallel_for.h>

#include "diagnose/group_statistics.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// The Gram matrices of all columns, and what weighs sets of them.
class Scales {
 public:
  Scales(const Study& study, const Evidence& evidence, const Linearisation& about)
      : study_(study), about_(about), scales_(evidence.error().scales),
        grams_(evidence.grams(about.changes, about.residual)), priors_(scale_priors(study, evidence.error().scales)) {}

  EffectSet weigh(const std::vector<const Way*>& chosen) const {
    EffectSet out;
    out.chosen = chosen;
    for (const Way* way : chosen) out.effects.push_back(way->effect);
    const std::vector<Size> sizes = sizes_of(about_, chosen);
    double most = -1e300;
    for (size_t s = 0; s < grams_.size(); ++s) {
      const std::vector<Prior> priors = priors_of(study_, about_.columns, about_.x, sizes, scales_[s]);
      out.log_evidence.push_back(posterior(grams_[s], priors).log_evidence);
      const double here = out.log_evidence.back() + std::max(priors_.right[s], priors_.unknown[s]);
      if (here <= most) continue;
      most = here;
      out.scale = s;
    }
    return out;
  }

  // Whichever way an effect is there.
  double total(const EffectSet& set) const {
    std::vector<double> logs;
    for (size_t s = 0; s < set.log_evidence.size(); ++s)
      logs.push_back(set.log_evidence[s] + std::max(priors_.right[s], priors_.unknown[s]));
    return log_sum(logs);
  }

 private:
  const Study& study_;
  const Linearisation& about_;
  std::vector<double> scales_;
  std::vector<Gram> grams_;
  ScalePriors priors_;
};

// The mean over ways, with the estimate of the likeliest.
EffectSet over_ways(const Scales& scales, const std::vector<EffectSet>& ways) {
  size_t best = 0;
  for (size_t i = 1; i < ways.size(); ++i)
    if (scales.total(ways[i]) > scales.total(ways[best])) best = i;
  EffectSet out = ways[best];
  for (size_t s = 0; s < out.log_evidence.size(); ++s) {
    std::vector<double> logs;
    for (const EffectSet& w : ways) logs.push_back(w.log_evidence[s]);
    out.log_evidence[s] = log_sum(logs) - std::log(static_cast<double>(ways.size()));
  }
  return out;
}

// How much what is left of held-out trials leaves of a set's odds, with nothing unknown beside.
class Odds {
 public:
  explicit Odds(const std::map<std::vector<size_t>, GapTaken>& taken) : taken_(taken) {
    for (const auto& [effects, t] : taken)
      if (!effects.empty()) not_looked_at_ = std::min(not_looked_at_, least_factor(t.p_of_right));
  }
  double of(const std::vector<size_t>& effects) const {
    const auto place = taken_.find(effects);
    if (place != taken_.end()) return least_factor(place->second.p_of_right);
    return effects.empty() ? 1 : not_looked_at_;
  }
  // That each of its effects takes a part of the gap, as was seen.
  double all_take(const std::vector<size_t>& effects) const {
    const auto place = taken_.find(effects);
    if (place == taken_.end()) return effects.empty() ? 1 : 0;
    double out = 1;
    for (const double takes : place->second.takes) out *= takes;
    return out;
  }

 private:
  const std::map<std::vector<size_t>, GapTaken>& taken_;
  double not_looked_at_ = 1;
};

// The evidence of a set over all s, by their priors.
struct OverScales {
  OverScales(const EffectSet& set, const std::vector<double>& log_priors, double tempering) {
    std::vector<double> logs;
    for (size_t s = 0; s < log_priors.size(); ++s) logs.push_back(set.log_evidence[s] + log_priors[s]);
    log_evidence = tempering * log_sum(logs);
    scale = static_cast<size_t>(std::max_element(logs.begin(), logs.end()) - logs.begin());
  }
  double log_evidence = 0;
  size_t scale = 0;  // the likeliest
};

double prior_of_set(const Study& study, const EffectSet& set, bool and_unknown) {
  const Protocol& p = study.protocol;
  const auto n = static_cast<double>(study.effects.size());
  const double one = 1 - p.prior_none - p.prior_unknown - p.prior_two - p.prior_three,
               beside = and_unknown ? p.prior_beside : 1 - p.prior_beside;
  if (set.effects.empty()) return and_unknown ? p.prior_unknown : p.prior_none;
  if (set.effects.size() == 1) return beside * one / n;
  if (set.effects.size() == 2) return beside * p.prior_two / std::max(1.0, n * (n - 1) / 2);
  return beside * p.prior_three / std::max(1.0, n * (n - 1) * (n - 2) / 6);
}

// Adds a hypothesis to what is told: its effects as far as they take a part of the gap, and what is unknown beside, by
// their parts; else none or unknown. none: what held-out trials leave of none's odds.
void tell(const Study& study, const GapTaken& taken, double none, const Weight& w, Verdict& out) {
  double sum = 0, no_effect = 1;
  std::vector<double> parts = taken.parts;
  if (std::none_of(parts.begin(), parts.end(), [](double part) { return part > 0; })) parts.assign(w.effects.size(), 1);
  for (size_t k = 0; k < w.effects.size(); ++k) {
    const double takes = taken.takes.empty() ? 1 : taken.takes[k];
    parts[k] = takes * std::max(0.0, parts[k]);
    sum += parts[k];
    no_effect *= 1 - takes;
    out.inclusion[study.effects[w.effects[k]].name] += w.probability * takes;
  }
  if (!(sum > 0)) no_effect = 1;
  const double beside = w.and_unknown ? taken.unexplained : 0;
  sum += beside;
  const double is_none = w.and_unknown ? 0 : w.effects.empty() ? 1 : none;
  out.probability["none"] += w.probability * no_effect * is_none;
  out.probability["unknown"] += w.probability * no_effect * (1 - is_none);
  if (no_effect < 1) out.probability["unknown"] += w.probability * (1 - no_effect) * beside / sum;
  for (size_t k = 0; k < parts.size() && no_effect < 1; ++k)
    out.probability[study.effects[w.effects[k]].name] += w.probability * (1 - no_effect) * parts[k] / sum;
}

}  // namespace

ScalePriors scale_priors(const Study& study, const std::vector<double>& scales) {
  ScalePriors out;
  std::vector<double> right, unknown;
  for (const double s : scales) {
    const double z = std::log(s / study.right_scale) / study.protocol.right_sd;
    right.push_back(-0.5 * z * z);
    unknown.push_back(s >= study.protocol.unknown_over * study.right_scale ? 0 : -1e6);
  }
  const double r = log_sum(right), u = log_sum(unknown);
  for (size_t k = 0; k < scales.size(); ++k) {
    out.right.push_back(right[k] - r);
    out.unknown.push_back(unknown[k] - u);
  }
  return out;
}

EffectSet weigh_set(const Study& study, const Evidence& evidence, const Linearisation& about,
                    const std::vector<const Way*>& chosen) {
  return Scales(study, evidence, about).weigh(chosen);
}

std::vector<size_t> likeliest_beside(const Study& study, const Evidence& evidence, const Linearisation& about,
                                     const std::vector<const Way*>& chosen) {
  const Scales scales(study, evidence, about);
  std::vector<std::vector<EffectSet>> ways(study.effects.size());
  for (const Way& way : about.ways) {
    const auto is_same = [&](const Way* other) { return other->effect == way.effect; };
    if (!about.can_tell[way.effect] || std::any_of(chosen.begin(), chosen.end(), is_same)) continue;
    std::vector<const Way*> with = chosen;
    with.push_back(&way);
    ways[way.effect].push_back(scales.weigh(with));
  }
  std::vector<std::pair<double, size_t>> found;
  for (size_t e = 0; e < ways.size(); ++e)
    if (!ways[e].empty()) found.emplace_back(-scales.total(over_ways(scales, ways[e])), e);
  std::sort(found.begin(), found.end());
  std::vector<size_t> out;
  for (const auto& [less, effect] : found) out.push_back(effect);
  return out;
}

std::vector<EffectSet> weigh_sets(const Study& study, const Evidence& evidence, const Linearisation& about) {
  const Scales scales(study, evidence, about);
  std::vector<EffectSet> out = {scales.weigh({})};
  std::vector<std::vector<EffectSet>> ways(study.effects.size());
  for (const Way& a : about.ways) ways[a.effect].push_back(scales.weigh({&a}));
  std::vector<EffectSet> singles;
  for (size_t e = 0; e < ways.size(); ++e)
    if (about.can_tell[e]) singles.push_back(over_ways(scales, ways[e]));
  out.insert(out.end(), singles.begin(), singles.end());

  std::vector<std::vector<const Way*>> asked;
  for (size_t a = 0; a < singles.size(); ++a)
    for (size_t b = a + 1; b < singles.size(); ++b) asked.push_back({singles[a].chosen[0], singles[b].chosen[0]});
  const auto weigh_all = [&] {
    std::vector<EffectSet> found(asked.size());
    tbb::parallel_for(size_t{0}, asked.size(), [&](size_t i) { found[i] = scales.weigh(asked[i]); });
    return found;
  };
  std::vector<EffectSet> pairs = weigh_all();
  out.insert(out.end(), pairs.begin(), pairs.end());
  std::stable_sort(pairs.begin(), pairs.end(),
                   [&](const EffectSet& a, const EffectSet& b) { return scales.total(a) > scales.total(b); });
  asked.clear();
  std::set<std::vector<size_t>> seen;
  for (size_t i = 0; i < std::min(pairs.size(), static_cast<size_t>(study.protocol.pairs_tried)); ++i)
    for (const EffectSet& third : singles) {
      std::vector<const Way*> three = pairs[i].chosen;
      if (three[0]->effect == third.effects[0] || three[1]->effect == third.effects[0]) continue;
      three.push_back(third.chosen[0]);
      std::sort(three.begin(), three.end(), [](const Way* a, const Way* b) { return a->effect < b->effect; });
      if (seen.insert({three[0]->effect, three[1]->effect, three[2]->effect}).second) asked.push_back(three);
    }
  const std::vector<EffectSet> threes = weigh_all();
  out.insert(out.end(), threes.begin(), threes.end());
  return out;
}

Verdict judge(const Study& study, const std::vector<EffectSet>& sets, const std::vector<double>& scales,
              const std::map<std::vector<size_t>, GapTaken>& taken) {
  const ScalePriors priors = scale_priors(study, scales);
  const Odds odds(taken);
  Verdict out;
  std::vector<double> logs;
  for (const EffectSet& set : sets) {
    const OverScales right(set, priors.right, study.protocol.tempering),
        unknown(set, priors.unknown, study.protocol.tempering);
    const double held_out = odds.of(set.effects), all_take = odds.all_take(set.effects),
                 hidden = right.log_evidence + std::log((1 - held_out) * all_take);
    logs.push_back(right.log_evidence + std::log(prior_of_set(study, set, false) * held_out));
    logs.push_back(log_sum({unknown.log_evidence, hidden}) + std::log(prior_of_set(study, set, true)));
    out.weights.push_back({set.effects, false, 0, right.scale, all_take});
    out.weights.push_back(
        {set.effects, true, 0, hidden > unknown.log_evidence ? right.scale : unknown.scale, all_take});
  }
  const double all = log_sum(logs);
  for (size_t i = 0; i < logs.size(); ++i) out.weights[i].probability = std::exp(logs[i] - all);
  out.probability["none"] = out.probability["unknown"] = 0;
  for (const Effect& e : study.effects) out.inclusion[e.name] = out.probability[e.name] = 0;
  for (const Weight& w : out.weights) {
    const auto place = taken.find(w.effects);
    tell(study, place == taken.end() ? GapTaken{} : place->second, odds.of({}), w, out);
  }
  for (auto& [name, p] : out.inclusion) p = std::min(p, 1.0);  // sums round
  std::stable_sort(out.weights.begin(), out.weights.end(),
                   [](const Weight& a, const Weight& b) { return a.probability > b.probability; });
  return out;
}

}  // namespace selvedge::diagnose
