#include "station/session_verdict.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace selvedge::station {

namespace {

using nlohmann::json;
using report::Trust;
using report::Verdict;

struct Answers {
  int there = 0, believed = 0;
};

// Of the fits or the diagnoses. Those without a verdict, of an older version, are not counted as believed.
Answers weigh_answers(const json& fabrics, const char* kind, Verdict& verdict) {
  Answers answers;
  for (const auto& [name, fabric] : fabrics.items()) {
    if (!fabric.contains(kind)) continue;
    ++answers.there;
    const auto own = report::read_verdict(fabric[kind].value("verdict", json()));
    if (!own) verdict.lower(Trust::limited, fmt::format("the {} of {} has no verdict", kind, name));
    if (!own || own->trust == Trust::full) {
      answers.believed += own.has_value();
      continue;
    }
    verdict.lower(own->trust, fmt::format("the {} of {} is {}: {}", kind, name, to_text(own->trust),
                                          fmt::join(own->because, "; ")));
  }
  return answers;
}

void weigh_calibrations(const json& steps, Verdict& verdict) {
  for (const auto& [id, step] : steps.items()) {
    const json found = step.value("/result/verdict"_json_pointer, json());
    if (found == "doubtful") verdict.lower(Trust::limited, fmt::format("the calibration ({}) is doubtful", id));
    if (found == "refused") verdict.lower(Trust::none, fmt::format("the calibration ({}) is refused", id));
  }
}

// Whether all trials of a fabric were recorded; those that a step gave up are named with the steps.
bool is_recorded(const json& fabric) {
  const json& trials = fabric["trials"];
  return !trials.empty() &&
         std::all_of(trials.begin(), trials.end(), [](const json& t) { return t["state"] == "done"; });
}

void weigh_steps(const json& summary, Verdict& verdict) {
  for (const auto& [id, step] : summary["steps"].items()) {
    const std::string state = step.value("state", "");
    if (state == "done") continue;
    const std::string why = step.value("why", "");
    verdict.lower(Trust::limited, fmt::format("{} {}{}", id,
                                              state == "skipped"  ? "was given up"
                                              : state == "failed" ? "failed"
                                                                  : "was begun and not ended",
                                              why.empty() ? "" : ": " + why));
  }
  for (const auto& [name, fabric] : summary["fabrics"].items()) {
    const json& trials = fabric["trials"];
    const auto missing =
        std::count_if(trials.begin(), trials.end(), [](const json& t) { return t["state"] == "not begun"; });
    if (missing > 0)
      verdict.lower(Trust::limited,
                    fmt::format("{} of {} trials of {} were not recorded", missing, trials.size(), name));
  }
}

std::string part(const Answers& answers, const char* done) {
  return answers.there == 0 ? fmt::format("none {}", done)
                            : fmt::format("{} {}, {} of them to be believed", answers.there, done, answers.believed);
}

}  // namespace

Verdict verdict_of_session(const json& summary) {
  Verdict verdict;
  const json& fabrics = summary["fabrics"];
  weigh_steps(summary, verdict);
  weigh_calibrations(summary["steps"], verdict);
  const Answers fits = weigh_answers(fabrics, "fit", verdict), diagnoses = weigh_answers(fabrics, "diagnosis", verdict);
  verdict.sentence = fmt::format(
      "of {} fabric{} {} recorded in full; {}; {}", fabrics.size(), fabrics.size() == 1 ? "" : "s",
      std::count_if(fabrics.begin(), fabrics.end(), is_recorded), part(fits, "fitted"), part(diagnoses, "diagnosed"));
  return verdict;
}

}  // namespace selvedge::station
