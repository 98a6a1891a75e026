// The steps of a session that nobody knew of at its beginning: they follow from what a diagnosis said.
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "station/confirmation.h"
#include "station/diagnosis_folder.h"
#include "station/rig_steps.h"
#include "station/station_steps.h"

namespace selvedge::station {

std::vector<Step> StationSteps::follow_up(const Step& diagnosed) {
  const std::filesystem::path folder = fabric_folder(diagnosed) / diagnosis_folder_name(diagnosed.round);
  auto plan = read_follow_up(file_, diagnosed.fabric, folder / "next_session.toml");
  if (!plan) return {};
  const int round = diagnosed.round + 1;
  std::vector<Step> steps;
  for (session::TrialPlan& trial : plan->trials) {
    if (round > 1) trial.name += fmt::format("-round-{}", round);
    steps.push_back({"record", diagnosed.fabric, trial.name, round, expected_trial_s(trial)});
  }
  auto& all = appended_[diagnosed.fabric];
  if (!all.trials.empty()) plan->trials.insert(plan->trials.begin(), all.trials.begin(), all.trials.end());
  all = std::move(*plan);
  if (file_.fit) steps.push_back({"fit", diagnosed.fabric, "", round, kFit_s});
  steps.push_back({"diagnose", diagnosed.fabric, "", round, kDiagnosis_s});
  return steps;
}

std::vector<Step> StationSteps::second_session(const Step& diagnosed) {
  auto plan =
      plan_of_second_session(file_.fabrics[diagnosed.fabric].plan, fabric_folder(diagnosed) / diagnosis_folder_name(0));
  if (!plan) return {};
  std::vector<Step> steps;
  for (const session::TrialPlan& trial : plan->trials)
    steps.push_back({"record", diagnosed.fabric, trial.name, 0, expected_trial_s(trial), true});
  steps.push_back({"confirm", diagnosed.fabric, "", 0, kConfirm_s, true});
  second_[diagnosed.fabric] = std::move(*plan);
  return steps;
}

}  // namespace selvedge::station
