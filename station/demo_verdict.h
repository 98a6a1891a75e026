// What a run of the demo found beside what the simulated fabric was, and what it had hidden. Everything is read from
// what the run left on disk: fit.json, diagnosis/diagnosis.json, confirmation/confirmation.json, truth.json.
//
// Bounds: every parameter that the fit calls determined lies within 15 % of the truth, and the held-out frames'
// error is at most 1.5 times the fitted frames' of the same trials. Held-out frames all show fabric in motion, so
// the fitted ones are counted from the held corners' first move: the still lead-in would flatter them. Parameters are
// compared as they are with the named effect added, where one is named: a fit that lacks it bends them in its place.
// What was hidden has to be named, and its second session predicted better with it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace selvedge::station {

struct ParameterVerdict {
  std::string name, unit;
  double found = 0, lower = 0, upper = 0, truth = 0;
  std::optional<double> with_effect;  // by the diagnosis
  bool determined = false;
  double off_percent() const { return 100 * (with_effect.value_or(found) / truth - 1); }
};

struct DemoVerdict {
  static constexpr double kLargestOff_percent = 15;
  static constexpr double kLargestRatio = 1.5;

  std::vector<ParameterVerdict> parameters;
  double fitted_mm = 0, held_out_mm = 0;  // root mean square over the trials with held-out frames
  std::string named;                      // an effect, "none" or "unknown"
  std::string hidden;                     // in words, with its size
  bool names_it = false;
  std::string diagnosis, confirmation, truth;  // a sentence each
  bool predicts_better = false;                // the second session, with the effect
  size_t determined() const;
  bool parameters_hold() const;  // at least one determined, none of those further off than allowed
  bool held_out_holds() const;
  // Named right; and where there is something to name, a second session was predicted better with it.
  bool diagnosis_holds() const;
  bool holds() const { return parameters_hold() && held_out_holds() && diagnosis_holds(); }
};

// What the files of a run say.
struct DemoAnswers {
  nlohmann::json fit, diagnosis, confirmation, truth;  // confirmation: null where nothing was to be confirmed
};
DemoAnswers read_demo_answers(const std::filesystem::path& folder);

// truth: {"parameters": {NAME: {"value", "unit"}}, "hidden": [{"effect", "size": {NAME: VALUE}}]}, as the simulated
// devices write it.
DemoVerdict judge(const DemoAnswers& answers);

// About two dozen lines.
std::string to_text(const DemoVerdict& verdict);
nlohmann::json to_json(const DemoVerdict& verdict);

}  // namespace selvedge::station
