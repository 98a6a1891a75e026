// Whether a diagnosis holds in motions that it has not seen: a second, short session on the same rig records what the
// diagnosis forecasts, and each of its trials is predicted from rest, by the fit as it was and with the effect added.
//
//   fit        the parameters of fit.json
//   base       those of the base model as the diagnosis has it, without the effect
//   with it    those of the diagnosis' likeliest set of effects (diagnosis.json, "fit")
//
// All three on one grid, hung as the fabric was seen to hang; nothing is fitted to the second session. mm, root mean
// square from the held corners' first move on, for as long as the diagnosis forecasts. FABRIC/confirmation/ holds the
// trials, campaign.json, simulated/ (with the effect), confirmation.json and report.html.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/session/session_plan.h"
#include "capture/trial/trial.h"
#include "report/progress.h"
#include "report/verdict.h"

namespace selvedge::station {

inline constexpr const char* kConfirmationFolder = "confirmation";

struct ConfirmedTrial {
  std::string name;
  double fit_mm = 0, base_mm = 0, with_mm = 0;
};

struct Confirmation {
  // confirmed: with the effect the squared error falls by half of the share that the diagnosis forecasts, or more, and
  // to no more than twice the error that it forecasts; better: it falls; refuted: it does not.
  enum class Outcome { confirmed, better, refuted };
  Outcome outcome = Outcome::refuted;
  std::string cause, likeliest;  // of the diagnosis: the effect, and the set that it stands in
  std::string motion;            // that was forecast, in words
  double moving_s = 0;           // for how long after its first move; infinite: all of it
  double forecast_before_mm = 0, forecast_low_mm = 0, forecast_high_mm = 0, forecast_after_mm = 0;
  double before_mm = 0, base_mm = 0, after_mm = 0;  // over all trials
  int cells = 0;                                    // of the grid, along the width
  std::vector<ConfirmedTrial> trials;
};

const char* to_text(Confirmation::Outcome outcome);

// The session that a diagnosis (the folder of diagnosis.json) asks for: the motion that it forecasts, as `recorded`
// has it but so much faster. None where it names no effect, or forecasts nothing.
std::optional<session::SessionPlan> plan_of_second_session(const session::SessionPlan& recorded,
                                                           const std::filesystem::path& diagnosis);

// fit.json and diagnosis.json of the first session.
struct FirstAnswers {
  nlohmann::json fit, diagnosis;
};

// Predicts the second session; writes its simulated motions below the folder.
Confirmation confirm(const FirstAnswers& answers, const trial::Campaign& second, const std::filesystem::path& folder,
                     const report::ProgressCallback& progress);
// FABRIC/confirmation/ by FABRIC/fit.json and FABRIC/diagnosis/. Writes the simulated motions. Throws BadInput where
// one of them is missing or another's.
Confirmation confirm(const std::filesystem::path& fabric, const report::ProgressCallback& progress);

report::Verdict verdict_of(const Confirmation& confirmation);

// FOLDER/confirmation.json and FOLDER/report.html.
void write_confirmation(const Confirmation& confirmation, const std::filesystem::path& folder);

}  // namespace selvedge::station
