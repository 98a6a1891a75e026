// The steps of a session that need the rig: calibrating it, and recording one trial after the other. Who runs them, and
// in what order, is in session_steps.h.
//
//   calibrate: calibrating.h → each trial: capture/session/run_trial.h, at rest before it a look at where the projector
//   stands (projector_check.h) → campaign.json
//
// Prompts go out on OPERATOR_PROMPT.
#pragma once

#include <filesystem>
#include <vector>

#include "calib/calibration.h"
#include "capture/session/run_trial.h"
#include "capture/session/session_plan.h"
#include "report/progress.h"

namespace selvedge::station {

// About how long the session takes, s, from what was asked for; progress is shared out by it.
double expected_calibration_s(const session::SessionPlan& plan);
double expected_trial_s(const session::TrialPlan& trial);

// Calibrates into FOLDER/calibration/ and copies its result to FOLDER/calibration.json. Throws DeviceFailed where the
// verdict is "refused".
calib::Calibration calibrate_session(session::RigClient& rig, const session::SessionPlan& plan,
                                     const std::filesystem::path& folder, const report::ProgressCallback& progress);

// One trial, with the look at where the projector stands: FOLDER/NAME.
session::TrialRecord record_session_trial(session::RigClient& rig, const rig::Configuration& configuration,
                                          const session::SessionPlan& plan, const session::TrialPlan& trial,
                                          const session::RigOptics& optics, const std::filesystem::path& folder,
                                          const report::ProgressCallback& progress);

// FOLDER/campaign.json of these trials.
void write_session_campaign(const std::string& fabric, const std::vector<std::string>& trials,
                            const std::vector<std::vector<std::string>>& replicates,
                            const std::filesystem::path& folder);

}  // namespace selvedge::station
