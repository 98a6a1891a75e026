// A set of effects, looked at in trials that it was not fitted to, beside the base with its effects neutral.
#pragma once

#include <string>
#include <vector>

#include "diagnose/budget.h"
#include "diagnose/effect_sets.h"
#include "diagnose/next_experiment.h"
#include "diagnose/weighing.h"

namespace selvedge::diagnose {

// Of trials that nothing was fitted to: root mean square, mm, of predictions Protocol::free_s ahead where markers hold
// the sheet, else of motions that run free.
struct GapReduction {
  double before_mm = 0, after_mm = 0;
  double fraction = 0, low = 0, high = 0;  // 90 % for as many trials again, jackknife over groups; NaN for one group
};

// What all looks at sets need. study counts evaluations.
struct Weighed {
  Study& study;
  const Windows& windows;
  const Weighing& weighing;
  HeldOut noise;

  const Evidence& evidence() const { return *weighing.evidence; }
};

struct LookedAt {
  const Linearisation* about = nullptr;  // of the weighing
  Arm arm;
  size_t scale = 0;
  Posterior posterior;
  HeldOut before, after;
  PredictedSet without, with;  // predicted by the base alone, and with the set
  std::vector<Share> parts;    // of the gap, an effect of the set each
  Share unexplained = {1, 1, 1};
};

// Sets of effects, each by itself; what has to be simulated for them goes side by side.
std::vector<LookedAt> look_at(const Weighed& weighed, const std::vector<std::vector<size_t>>& sets);

// What a right model leaves of held-out trials, mm: the sensor's noise and Protocol::form_mm, of pictures its share
// of one dimension.
double right_mm(const HeldOut& noise, const Protocol& protocol);

// How likely a right model is to leave as much: t test of the logarithms over groups of trials.
double p_of_gap(const HeldOut& before, const HeldOut& noise, const Protocol& protocol);

// What the set takes, for judge().
GapTaken taken_by(const LookedAt& looked_at, const HeldOut& noise, const Protocol& protocol);

GapReduction reduction_of(const Study& study, const LookedAt& looked_at, const HeldOut& noise);

}  // namespace selvedge::diagnose
