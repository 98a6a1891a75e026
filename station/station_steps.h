// The steps of a session as they are done: on the rig, and on the files that it leaves.
//
// FOLDER/rig.toml, world.toml, truth.json, logs/   of a simulated rig (station/simulated_rig.h)
// FOLDER/calibration.json, calibration/            or below FOLDER/FABRIC where each fabric has its own
// FOLDER/FABRIC/TRIAL, campaign.json, calibration-watch.json, fit.json, report.html, simulated/, diagnosis/
// FOLDER/FABRIC/confirmation/                      a second session (station/confirmation.h)
// The rig is started, or met, when the first step needs it and let go of when the recording is over.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "capture/session/run_trial.h"
#include "rig/bus.h"
#include "station/session_steps.h"
#include "station/simulated_rig.h"

namespace selvedge::station {

class StationSteps : public SessionSteps {
 public:
  // source: the folder with data/arms.
  StationSteps(const SessionFile& file, const Journal& journal, const std::filesystem::path& folder,
               const std::filesystem::path& source);
  ~StationSteps() override;

  nlohmann::json run(const Step& step, const report::ProgressCallback& progress) override;
  void set_aside(const Step& step) override;
  std::vector<Step> follow_up(const Step& diagnosed) override;
  std::vector<Step> second_session(const Step& diagnosed) override;

  // Before a fit or diagnosis, here or elsewhere: lets go of the rig and writes FABRIC/campaign.json.
  void prepare(const Step& step);
  // How far a step is, on the bus.
  void tell(const Step& step, double done, const std::string& message);

  // Asks on the bus (OPERATOR_PROMPT "ask", answered by OPERATOR_ANSWER) and at the terminal, where there is one.
  // No answer within an hour: stop.
  Answer ask(const std::string& question);

 private:
  struct Desk;
  const session::SessionPlan& plan_of(const Step& step) const;
  std::filesystem::path fabric_folder(const Step& step) const;
  std::filesystem::path trials_folder(const Step& step) const;
  std::filesystem::path calibration_folder(const Step& step) const;
  session::RigClient& rig(const report::ProgressCallback& progress);
  void let_go_of_rig();
  void hang(const Step& step);
  session::RigOptics optics_of(const Step& step);
  void write_campaign(const Step& step);

  nlohmann::json calibrate(const Step& step, const report::ProgressCallback& progress);
  nlohmann::json record(const Step& step, const report::ProgressCallback& progress);

  const SessionFile& file_;
  const Journal& journal_;
  const std::filesystem::path folder_, source_;
  std::map<size_t, session::SessionPlan> appended_;  // plans of follow-ups, by fabric
  std::map<size_t, session::SessionPlan> second_;    // of second sessions, by fabric
  rig::Configuration configuration_;
  std::unique_ptr<SimulatedRig> simulated_;
  std::unique_ptr<session::RigClient> rig_;
  std::unique_ptr<Desk> desk_;
  std::optional<size_t> hung_;  // fabric
  bool drifted_ = false;        // the next trial is recorded after another calibration
  double told_s_ = 0;
};

}  // namespace selvedge::station
