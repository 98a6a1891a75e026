// Which effects are there: the evidence for none, each effect, each pair, threes beside the best pairs, each with and
// without something unknown beside, as probabilities.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "diagnose/arm.h"

namespace selvedge::diagnose {

// A set of effects as closed forms have it, about the base fit.
struct EffectSet {
  std::vector<size_t> effects;       // ascending
  std::vector<const Way*> chosen;    // the likeliest of each effect
  std::vector<double> log_evidence;  // one each s, over all ways
  size_t scale = 0;                  // the likeliest s
};

// One of them.
EffectSet weigh_set(const Study& study, const Evidence& evidence, const Linearisation& about,
                    const std::vector<const Way*>& chosen);

// The other effects that can be told, by what they add to a set's evidence, the most first.
std::vector<size_t> likeliest_beside(const Study& study, const Evidence& evidence, const Linearisation& about,
                                     const std::vector<const Way*>& chosen);

// None, singles, pairs and some threes.
std::vector<EffectSet> weigh_sets(const Study& study, const Evidence& evidence, const Linearisation& about);

// Logarithms of the priors of s, one each scale: of a right model, and of one that lacks something unknown.
struct ScalePriors {
  std::vector<double> right, unknown;
};
ScalePriors scale_priors(const Study& study, const std::vector<double>& scales);

// One hypothesis: a set of effects, and whether there is something unknown beside.
struct Weight {
  std::vector<size_t> effects;
  bool and_unknown = false;
  double probability = 0;
  size_t scale = 0;      // the likeliest s
  double borne_out = 0;  // what is left of the probability, or added to it, by what sets take of the gap
};

struct Verdict {
  std::vector<Weight> weights;                // by probability
  std::map<std::string, double> inclusion;    // of every effect
  std::map<std::string, double> probability;  // none, unknown, every effect; a set's mass by its effects' shares; adds
                                              // up to 1
};

// What a set takes of the gap in trials that it was not fitted to.
struct GapTaken {
  std::vector<double> parts;  // an effect's each, in the set's order
  double explained = 1;       // all of it, of what a right model would take
};

// Probabilities of the sets. p_of_right: how likely a right model leaves as much of held-out trials as the base does;
// it speaks against none, as little as such a p can. taken: by the set's effects; missing: all of it, by each effect
// alike. A set that takes less than Protocol::explains leaves so much of its probability to the others, as they are
// likely without it and as far as they do take it, and else to unknown.
Verdict judge(const Study& study, const std::vector<EffectSet>& sets, const std::vector<double>& scales,
              const std::map<std::vector<size_t>, GapTaken>& taken, double p_of_right = 1);

}  // namespace selvedge::diagnose
