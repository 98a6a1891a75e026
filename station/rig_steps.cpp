#include "station/rig_steps.h"

#include "calib/calibration_file.h"
#include "capture/trial/trial_writer.h"
#include "files/whole_file.h"
#include "station/calibrating.h"
#include "station/projector_check.h"

namespace selvedge::station {

using session::RigClient;

namespace {

constexpr double kPose_s = 8;         // a grid pose with its patterns
constexpr double kBeforeTrial_s = 9;  // to hang, come to rest, and be looked at

}  // namespace

double expected_calibration_s(const session::SessionPlan& plan) { return kPose_s * plan.grid.poses; }

double expected_trial_s(const session::TrialPlan& trial) { return kBeforeTrial_s + trial.duration_s; }

calib::Calibration calibrate_session(RigClient& rig, const session::SessionPlan& plan,
                                     const std::filesystem::path& folder, const report::ProgressCallback& progress) {
  calib::Calibration calibration = calibrate_rig(rig, plan, folder / "calibration", progress);
  if (calibration.verdict == calib::Verdict::refused || !calibration.projector)
    throw session::DeviceFailed("calibration refused: " + calibration.advice);
  // Durable: the session's journal calls the calibration done once this returns.
  files::write_whole(folder / "calibration.json", files::read_whole(folder / "calibration" / "calibration.json"));
  return calibration;
}

session::TrialRecord record_session_trial(RigClient& rig, const rig::Configuration& configuration,
                                          const session::SessionPlan& plan, const session::TrialPlan& trial,
                                          const session::RigOptics& optics, const std::filesystem::path& folder,
                                          const report::ProgressCallback& progress) {
  ProjectorCheck check;
  const auto at_rest = [&] { check = check_projector(rig, optics); };
  const session::TrialRecord record =
      session::run_trial(rig, configuration, plan, trial, optics, folder, progress, at_rest);
  write_projector_check(check, folder / trial.name);
  return record;
}

void write_session_campaign(const std::string& fabric, const std::vector<std::string>& trials,
                            const std::vector<std::vector<std::string>>& replicates,
                            const std::filesystem::path& folder) {
  trial::Campaign campaign;
  campaign.fabric = fabric;
  campaign.replicates = replicates;
  for (const std::string& name : trials) {
    trial::Trial trial;
    trial.name = name;
    campaign.trials.push_back(trial);
  }
  trial::write_campaign_json(campaign, folder);
}

}  // namespace selvedge::station
