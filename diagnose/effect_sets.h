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
  size_t scale = 0;     // the likeliest s
  double all_take = 1;  // that each of its effects takes a part of the gap, as far as groups of trials tell
};

struct Verdict {
  std::vector<Weight> weights;                // by probability
  std::map<std::string, double> inclusion;    // of every effect: that it is there and takes a part of the gap
  std::map<std::string, double> probability;  // none, unknown, every effect; a set's mass by the shares of its effects
                                              // and of what is unknown beside; adds up to 1
};

// What trials that a set was not fitted to say of it.
struct GapTaken {
  std::vector<double> parts;  // of the gap, an effect's each, in the set's order
  std::vector<double> takes;  // least_factor() of each: that it takes Protocol::least_part
  double p_of_right = 1;      // how likely a right model leaves as much as the set does
  double unexplained = 0;     // of the gap, beyond what a right model leaves
};

// Probabilities of the sets. taken: by the set's effects, of none by no effect. What a right model would hardly leave
// speaks against a set, and against none, as little as such a p can (f = least_factor), where nothing unknown is
// beside; with something unknown beside, which held-out trials alone may show, it counts 1 − f of that evidence, too,
// if its effects were seen to take a part there. Sets that were not looked at have the least f of those that were. What
// is unknown beside a set takes what nothing explains. An effect that takes nothing is not named: its set's mass is
// that of the set without it, and of unknown, where a right model would hardly leave what none leaves.
Verdict judge(const Study& study, const std::vector<EffectSet>& sets, const std::vector<double>& scales,
              const std::map<std::vector<size_t>, GapTaken>& taken);

}  // namespace selvedge::diagnose
