#include "station/file_steps.h"

#include <algorithm>

#include "capture/trial/trial.h"
#include "diagnose/diagnosis.h"
#include "diagnose/diagnosis_report.h"
#include "diagnose/effects/library.h"
#include "files/bad_input.h"
#include "files/json_number.h"
#include "fit/fit_campaign.h"
#include "fit/fit_report.h"
#include "fit/trial_errors.h"
#include "station/calibration_watch.h"
#include "station/confirmation.h"
#include "station/simulated_motion.h"

namespace selvedge::station {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

json fit_fabric(const SessionFile& file, const fs::path& folder, const report::ProgressCallback& progress) {
  const trial::Campaign campaign = trial::read_campaign(folder);
  write_watch(watch_calibration(campaign, [](double, const std::string&) {}), folder);
  fit::FitOptions options;
  options.cells = file.fit_cells;
  options.progress = progress;
  options.journal = folder / "iterations.txt";
  const fit::FitOutcome outcome = fit::fit_campaign(campaign, options);
  const trial::Campaign rig = trial::only_tests(campaign, false);
  fit::write_fit(outcome, rig, folder);
  write_simulated_motions(outcome, rig, folder);
  fs::remove(options.journal);  // of a fit that ended, nothing is to be gone on with
  return {{"held_out_mm", files::finite_or_null(fit::held_out_mm(outcome))}, {"simulations", outcome.evaluations}};
}

json diagnose_fabric(const SessionFile& file, const fs::path& fabric, int round,
                     const report::ProgressCallback& progress) {
  const fs::path folder = fabric / diagnosis_folder_name(round);
  fs::create_directories(folder);
  diagnose::DiagnosisOptions options;
  options.study.protocol.cells = file.diagnosis_cells;
  options.study.progress = progress;
  const trial::Campaign campaign = trial::read_campaign(fabric);
  if (file.fit) diagnose::begin_with_fit(options, campaign, {fabric});
  diagnose::keep_base_fit(options, folder / "base_fit.json", campaign);
  const diagnose::Diagnosis found = diagnose::diagnose(campaign, diagnosed_effects(file), options);
  diagnose::write_diagnosis(found, folder);
  return {{"cause", found.cause}, {"probability", found.probability.at(found.cause)}, {"side", found.side}};
}

json confirm_fabric(const fs::path& fabric, const report::ProgressCallback& progress) {
  const Confirmation found = confirm(fabric, progress);
  write_confirmation(found, fabric / kConfirmationFolder);
  return {{"outcome", to_text(found.outcome)}, {"before_mm", found.before_mm}, {"after_mm", found.after_mm}};
}

}  // namespace

std::vector<diagnose::Effect> diagnosed_effects(const SessionFile& file) {
  std::vector<diagnose::Effect> chosen;
  for (const diagnose::Effect& effect : diagnose::effect_library())
    if (file.effects.empty() || std::find(file.effects.begin(), file.effects.end(), effect.name) != file.effects.end())
      chosen.push_back(effect);
  if (!file.effects.empty() && chosen.size() != file.effects.size()) {
    std::string names;
    for (const diagnose::Effect& effect : diagnose::effect_library())
      names += (names.empty() ? "" : ", ") + effect.name;
    refuse(file.path.string() + " [diagnosis] effects", "found a name that is none of {}", names);
  }
  return chosen;
}

json run_on_files(const SessionFile& file, const Step& step, const fs::path& folder,
                  const report::ProgressCallback& progress) {
  const fs::path fabric = file.folder_of(step.fabric, folder);
  if (step.kind == "confirm") return confirm_fabric(fabric, progress);
  return step.kind == "fit" ? fit_fabric(file, fabric, progress) : diagnose_fabric(file, fabric, step.round, progress);
}

}  // namespace selvedge::station
