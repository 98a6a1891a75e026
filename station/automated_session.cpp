#include "station/automated_session.h"

#include <fmt/format.h>

#include "calib/calibration_file.h"
#include "capture/trial/trial_writer.h"
#include "files/whole_file.h"
#include "station/calibrating.h"
#include "station/projector_check.h"

namespace selvedge::station {

namespace {

using session::RigClient;

constexpr double kStart_s = 8;        // daemons connect, the camera's clock becomes known
constexpr double kPose_s = 8;         // a grid pose with its patterns
constexpr double kBeforeTrial_s = 9;  // to hang, come to rest, and be looked at
constexpr double kWatch_s = 5;        // held corners sought in the frames

// Hands the share [from, to] of the whole to one step, and says on the bus where the session stands.
class Steps {
 public:
  Steps(RigClient& rig, const session::SessionPlan& plan, report::ProgressCallback progress)
      : rig_(rig), progress_(std::move(progress)) {
    total_s_ = kStart_s + expected_calibration_s(plan) + kWatch_s;
    for (const session::TrialPlan& trial : plan.trials) total_s_ += expected_trial_s(trial);
  }

  report::ProgressCallback next(const std::string& step, const std::string& trial, double expected_s) {
    const double from = at_s_ / total_s_, to = (at_s_ + expected_s) / total_s_;
    at_s_ += expected_s;
    selvedge_rig::session_status_t status{};
    status.step = step;
    status.trial = trial;
    status.done = from;
    rig_.publish_status(status);
    return [this, from, to, name = trial.empty() ? step : trial](double done, const std::string& what) {
      progress_(from + (to - from) * done, name + ": " + what);
    };
  }

 private:
  RigClient& rig_;
  report::ProgressCallback progress_;
  double total_s_ = 0, at_s_ = 0;
};

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

SessionResult run_session(const rig::Configuration& configuration, const std::filesystem::path& folder,
                          const report::ProgressCallback& progress) {
  const session::SessionPlan plan = session::read_session_plan(configuration);
  std::filesystem::create_directories(folder);
  RigClient rig(configuration);
  Steps steps(rig, plan, progress);

  const auto starting = steps.next("starting", "", kStart_s);
  rig.wait_until_running(plan.answer_timeout_s, [&](const std::string& missing) { starting(0.5, missing); });

  SessionResult result;
  result.calibration =
      calibrate_session(rig, plan, folder, steps.next("calibrating", "", expected_calibration_s(plan)));
  const session::RigOptics optics{result.calibration.camera.projection(), result.calibration.projector->projection()};
  std::vector<std::string> names;
  for (const session::TrialPlan& trial : plan.trials) {
    result.trials.push_back(record_session_trial(rig, configuration, plan, trial, optics, folder,
                                                 steps.next("recording", trial.name, expected_trial_s(trial))));
    names.push_back(trial.name);
  }
  write_session_campaign(plan.fabric.name, names, {}, folder);

  selvedge_rig::operator_prompt_t done{};
  done.step = "done";
  done.text = "the session is over";
  rig.ask(done);
  rig.show({});
  result.watch = watch_calibration(trial::read_campaign(folder), steps.next("checking", "", kWatch_s));
  write_watch(result.watch, folder);
  steps.next("done", "", 0)(1, "");
  return result;
}

}  // namespace selvedge::station
