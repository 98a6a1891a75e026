// What a fit found beside what the simulated fabric was.
//
// Bounds: every parameter that the fit calls determined lies within 15 % of the truth, and the held-out frames'
// error is at most 1.5 times the fitted frames' of the same trials. Held-out frames all show fabric in motion, so
// the fitted ones are counted from the held corners' first move: the still lead-in would flatter them.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "fit/fit_campaign.h"

namespace selvedge::station {

struct ParameterVerdict {
  std::string name, unit;
  double found = 0, lower = 0, upper = 0, truth = 0;
  bool determined = false;
  double off_percent() const { return 100 * (found / truth - 1); }
};

struct DemoVerdict {
  static constexpr double kLargestOff_percent = 15;
  static constexpr double kLargestRatio = 1.5;

  std::vector<ParameterVerdict> parameters;
  double fitted_mm = 0, held_out_mm = 0;  // root mean square over the trials with held-out frames
  size_t determined() const;
  bool parameters_hold() const;  // at least one determined, none of those further off than allowed
  bool held_out_holds() const;
};

// truth: {"parameters": {NAME: {"value", "unit"}}}, as the simulated devices write it.
DemoVerdict judge(const fit::FitOutcome& outcome, const nlohmann::json& truth);

// About a dozen lines.
std::string to_text(const DemoVerdict& verdict);

}  // namespace selvedge::station
