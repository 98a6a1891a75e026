// A whole capture session on a running rig, without a person at the keyboard: calibrate, record the trials, and
// leave a campaign that `./selvedge fit` reads.
//
//   wait for the devices → calibrate (calibrating.h) → each trial in turn (capture/session/run_trial.h), at rest before
//   it a look at where the projector stands (projector_check.h) → campaign.json → do camera and projector still stand
//   where they were calibrated (calibration_watch.h)
//
// Prompts go out on OPERATOR_PROMPT, where the session stands on SESSION_STATUS.
#pragma once

#include <filesystem>
#include <vector>

#include "calib/calibration.h"
#include "capture/session/run_trial.h"
#include "capture/session/session_plan.h"
#include "report/progress.h"
#include "station/calibration_watch.h"

namespace selvedge::station {

struct SessionResult {
  calib::Calibration calibration;
  std::vector<session::TrialRecord> trials;
  CalibrationWatch watch;
};

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

// Writes FOLDER/calibration/, FOLDER/calibration.json, FOLDER/NAME for each trial, FOLDER/campaign.json,
// FOLDER/calibration-watch.json.
// Throws DeviceFailed where a device fails for good, and where the calibration's verdict is "refused".
SessionResult run_session(const rig::Configuration& configuration, const std::filesystem::path& folder,
                          const report::ProgressCallback& progress);

}  // namespace selvedge::station
