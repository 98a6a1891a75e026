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
      std::vector<Prior> priors;
      for (size_t k = 0; k < sizes.size(); ++k)
        priors.push_back(prior_of(study_, about_.columns[k], about_.x, sizes[k], scales_[s]));
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

// Probabilities as far as what sets take of the gap bears them out. The rest of a set's goes to the others as they are
// likely without it, again as far as they are borne out, and else to unknown: to `left`.
std::vector<double> borne_out(const std::vector<Weight>& weights, const std::map<std::vector<size_t>, GapTaken>& taken,
                              double explains, double& left) {
  std::vector<double> out, share, receives;  // share: that is borne out
  for (const Weight& w : weights) {
    const auto given = taken.find(w.effects);
    const bool is_known = given != taken.end();
    share.push_back(is_known ? std::clamp(given->second.explained / explains, 0.0, 1.0) : 1);
    receives.push_back(is_known || w.effects.empty() ? share.back() : 0);
    out.push_back(w.probability * share.back());
  }
  for (size_t i = 0; i < weights.size(); ++i) {
    const double rest = weights[i].probability * (1 - share[i]);
    if (rest <= 0) continue;
    double others = 0, given = 0;
    for (const Weight& w : weights)
      if (w.effects != weights[i].effects) others += w.probability;
    for (size_t j = 0; j < weights.size() && others > 0; ++j) {
      if (weights[j].effects == weights[i].effects) continue;
      const double gains = rest * receives[j] * weights[j].probability / others;
      out[j] += gains;
      given += gains;
    }
    left += rest - given;
  }
  return out;
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
              const std::map<std::vector<size_t>, GapTaken>& taken, double p_of_right) {
  const Protocol& p = study.protocol;
  const ScalePriors priors = scale_priors(study, scales);
  const auto n = static_cast<double>(study.effects.size());
  const double one = 1 - p.prior_none - p.prior_unknown - p.prior_two - p.prior_three;
  const auto prior_of = [&](const EffectSet& set, bool and_unknown) {
    if (set.effects.empty()) return and_unknown ? p.prior_unknown : p.prior_none * least_factor(p_of_right);
    const double beside = and_unknown ? p.prior_beside : 1 - p.prior_beside;
    if (set.effects.size() == 1) return beside * one / n;
    if (set.effects.size() == 2) return beside * p.prior_two / std::max(1.0, n * (n - 1) / 2);
    return beside * p.prior_three / std::max(1.0, n * (n - 1) * (n - 2) / 6);
  };
  Verdict out;
  std::vector<double> logs;
  for (const EffectSet& set : sets)
    for (const bool and_unknown : {false, true}) {
      std::vector<double> over_s;
      for (size_t s = 0; s < scales.size(); ++s)
        over_s.push_back(set.log_evidence[s] + (and_unknown ? priors.unknown : priors.right)[s]);
      logs.push_back(p.tempering * log_sum(over_s) + std::log(std::max(prior_of(set, and_unknown), 1e-12)));
      out.weights.push_back({set.effects, and_unknown, 0,
                             static_cast<size_t>(std::max_element(over_s.begin(), over_s.end()) - over_s.begin()), 0});
    }
  const double all = log_sum(logs);
  for (size_t i = 0; i < logs.size(); ++i) out.weights[i].probability = std::exp(logs[i] - all);
  out.probability["none"] = out.probability["unknown"] = 0;
  for (const Effect& e : study.effects) out.inclusion[e.name] = out.probability[e.name] = 0;
  const std::vector<double> masses = borne_out(out.weights, taken, p.explains, out.probability["unknown"]);
  for (size_t i = 0; i < masses.size(); ++i) {
    Weight& w = out.weights[i];
    w.borne_out = masses[i];
    if (w.effects.empty()) out.probability[w.and_unknown ? "unknown" : "none"] += masses[i];
    const auto given = taken.find(w.effects);
    double sum = 0;
    if (given != taken.end())
      for (const double part : given->second.parts) sum += std::max(0.0, part);
    for (size_t k = 0; k < w.effects.size(); ++k) {
      const std::string& name = study.effects[w.effects[k]].name;
      out.inclusion[name] += masses[i];
      const double share =
          sum > 0 ? std::max(0.0, given->second.parts[k]) / sum : 1.0 / static_cast<double>(w.effects.size());
      out.probability[name] += masses[i] * share;
    }
  }
  for (auto& [name, p] : out.inclusion) p = std::min(p, 1.0);  // sums round
  std::stable_sort(out.weights.begin(), out.weights.end(),
                   [](const Weight& a, const Weight& b) { return a.probability > b.probability; });
  return out;
}

}  // namespace selvedge::diagnose
