#include "station/station_steps.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>

#include <fmt/format.h>
#include <selvedge_rig/operator_answer_t.hpp>
#include <spdlog/spdlog.h>

#include "calib/calibration_file.h"
#include "capture/recovery.h"
#include "capture/session/operator_stop.h"
#include "capture/session/terminal.h"
#include "capture/trial/trial.h"
#include "files/bad_input.h"
#include "files/json_number.h"
#include "files/whole_file.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include "station/rig_steps.h"
#include "station/calibration_watch.h"
#include "station/confirmation.h"
#include "station/file_steps.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using session::DeviceFailed;

constexpr double kGone_s = 1.5;     // both corners gone for so long: the swatch is off
constexpr double kChange_s = 3600;  // for somebody to change the swatch
constexpr double kAnswer_s = 3600;
constexpr double kTell_s = 0.5;  // between words on the bus while nothing is recorded

// A trial that was recorded whole, but must not be used.
class CheckFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

void check(const session::TrialRecord& record, const SessionChecks& checks) {
  const double all = static_cast<double>(record.frames) + static_cast<double>(record.frames_lost);
  if (static_cast<double>(record.frames_lost) > checks.most_frames_lost * all)
    throw CheckFailed(fmt::format("{} of {:.0f} frames were lost", record.frames_lost, all));
  if (record.occluded_share > checks.most_occluded)
    throw CheckFailed(fmt::format("a corner was hidden in {:.0f} % of the samples", 100 * record.occluded_share));
  if (checks.at_rest && !record.started_at_rest)
    throw CheckFailed(fmt::format("the fabric did not come to rest within {:.0f} s", record.rest_s));
}

}  // namespace

// What is said on the bus beside the RigClient, and what the operator answers.
struct StationSteps::Desk {
  explicit Desk(const rig::BusConfiguration& configuration) : bus(configuration) {
    bus.subscribe<selvedge_rig::operator_answer_t>(rig::kOperatorAnswer,
                                                   [this](const selvedge_rig::operator_answer_t& message) {
      const std::lock_guard lock(mutex);
      answer = message.answer;
      answered_prompt = message.prompt_id;
    });
    bus.start();
  }
  // What was answered to this prompt, or to whichever was asked last; what was meant for another is dropped.
  std::string take_answer(int64_t prompt_id) {
    const std::lock_guard lock(mutex);
    const std::string given = std::exchange(answer, {});
    return answered_prompt == 0 || answered_prompt == prompt_id ? given : "";
  }
  std::mutex mutex;
  std::string answer;
  int64_t answered_prompt = 0;
  rig::Bus bus;
};

StationSteps::StationSteps(const SessionFile& file, const Journal& journal, const fs::path& folder,
                           const fs::path& source)
    : file_(file), journal_(journal), folder_(folder), source_(source) {
  diagnosed_effects(file);  // refused before anything is recorded
  if (file.world) {
    fs::create_directories(folder);
    files::write_whole(folder / "swatches.toml", file.simulated_world);
    // Where only fits are left to do, their progress is told on the bus of the rig that was.
    if (fs::exists(folder / "rig.toml"))
      desk_ = std::make_unique<Desk>(rig::Configuration::load(folder / "rig.toml").bus());
  } else {
    configuration_ = rig::Configuration::load(file.rig);
    desk_ = std::make_unique<Desk>(configuration_.bus());
  }
}

StationSteps::~StationSteps() { let_go_of_rig(); }

const session::SessionPlan& StationSteps::plan_of(const Step& step) const {
  if (step.second) return second_.at(step.fabric);
  const auto found = appended_.find(step.fabric);
  return step.round > 0 && found != appended_.end() ? found->second : file_.fabrics[step.fabric].plan;
}

fs::path StationSteps::fabric_folder(const Step& step) const { return file_.folder_of(step.fabric, folder_); }

// Where the trials lie that are recorded, or that the step is about.
fs::path StationSteps::trials_folder(const Step& step) const {
  return step.second ? fabric_folder(step) / kConfirmationFolder : fabric_folder(step);
}

fs::path StationSteps::calibration_folder(const Step& step) const {
  return file_.calibration == CalibrationPolicy::each ? fabric_folder(step) : folder_;
}

session::RigClient& StationSteps::rig(const report::ProgressCallback& progress) {
  if (file_.world && !simulated_) {
    desk_.reset();
    simulated_ = std::make_unique<SimulatedRig>(
        SimulatedRigFiles{file_.rig, folder_ / "swatches.toml", source_ / "data" / "arms"}, folder_);
    configuration_ = simulated_->configuration();
    desk_ = std::make_unique<Desk>(configuration_.bus());
    hung_.reset();
  }
  if (simulated_) simulated_->require_running();
  if (!rig_) {
    rig_ = std::make_unique<session::RigClient>(configuration_);
    rig_->wait_until_running(file_.fabrics[0].plan.answer_timeout_s, [&](const std::string& missing) {
      if (simulated_) simulated_->require_running();
      progress(0, missing);
    });
  }
  return *rig_;
}

void StationSteps::let_go_of_rig() {
  if (rig_) {
    selvedge_rig::operator_prompt_t done{};
    done.step = "done";
    done.text = "the recording is over";
    rig_->ask(done);
  }
  rig_.reset();
  simulated_.reset();
  hung_.reset();
}

// Asks for the swatch and waits until the old one is off: nothing else tells one swatch from another.
void StationSteps::hang(const Step& step) {
  if (hung_ == step.fabric) return;
  const SwatchPlan& swatch = file_.fabrics[step.fabric];
  selvedge_rig::operator_prompt_t prompt{};
  prompt.step = "change_swatch";
  prompt.index = static_cast<int32_t>(step.fabric);
  prompt.text = fmt::format("take down whatever hangs, this swatch too, and make ready \"{}\" ({:.0f} by {:.0f} mm)",
                            swatch.name, 1e3 * swatch.plan.fabric.width_m, 1e3 * swatch.plan.fabric.height_m);
  desk_->take_answer(0);
  int64_t asked = rig_->ask(prompt);
  double until_s = rig::host_now_s() + kChange_s;
  double gone_since_s = rig::host_now_s();
  rig_->forget_samples();
  while (rig::host_now_s() < until_s) {
    if (simulated_) simulated_->require_running();
    if (session::stop_holds(*rig_)) {
      session::wait_for_reset(*rig_, [&](double, const std::string& what) { tell(step, -1, what); });
      asked = rig_->ask(prompt);
      until_s = rig::host_now_s() + kChange_s;
    }
    rig_->remind();
    rig_->corners_after(rig::host_now_s() + 0.05, swatch.plan.answer_timeout_s);
    for (const auto& sample : rig_->take_corners())
      if (session::marker(sample, "left") || session::marker(sample, "right")) gone_since_s = rig::host_now_s();
    if (rig::host_now_s() - gone_since_s > kGone_s || desk_->take_answer(asked) == "done") {
      hung_ = step.fabric;
      return;
    }
    tell(step, -1, prompt.text);
  }
  throw DeviceFailed(fmt::format("nobody took down the swatch within {:.0f} s", kChange_s));
}

session::RigOptics StationSteps::optics_of(const Step& step) {
  const fs::path path = file_.calibration == CalibrationPolicy::reuse && !fs::exists(folder_ / "calibration.json")
                            ? file_.calibration_file
                            : calibration_folder(step) / "calibration.json";
  const calib::StoredCalibration stored = calib::read_calibration(path);
  if (!stored.projector) refuse(path.string(), "has no projector");
  return {stored.camera, *stored.projector};
}

json StationSteps::run(const Step& step, const report::ProgressCallback& progress) {
  const report::ProgressCallback told = [&](double done, const std::string& what) {
    if (simulated_) simulated_->require_running();
    if (step.kind != "record") tell(step, done, what);
    progress(done, what);
  };
  tell(step, 0, "begins");
  if (step.kind == "calibrate") return calibrate(step, told);
  if (step.kind == "record") return record(step, told);
  prepare(step);
  return run_on_files(file_, step, folder_, told);
}

json StationSteps::calibrate(const Step& step, const report::ProgressCallback& progress) {
  const calib::Calibration found = calibrate_session(rig(progress), plan_of(step), calibration_folder(step), progress);
  hung_.reset();
  return {{"verdict", calib::to_text(found.verdict)},
          {"camera_sd_px", files::finite_or_null(found.camera.deviation.mean_sd_px)},
          {"projector_sd_px", files::finite_or_null(found.projector->deviation.mean_sd_px)},
          {"triangulation_sd_mm", files::finite_or_null(found.triangulation_sd_mm)}};
}

json StationSteps::record(const Step& step, const report::ProgressCallback& progress) {
  const session::SessionPlan& plan = plan_of(step);
  const auto trial = std::find_if(plan.trials.begin(), plan.trials.end(),
                                  [&](const session::TrialPlan& t) { return t.name == step.trial; });
  session::RigClient& client = rig(progress);
  if (std::exchange(drifted_, false)) {
    calibrate_session(client, plan, calibration_folder(step), progress);
    hung_.reset();
  }
  hang(step);
  const fs::path folder = trials_folder(step);
  fs::create_directories(folder);
  const session::TrialRecord record =
      record_session_trial(client, configuration_, plan, *trial, optics_of(step), folder, progress);
  check(record, file_.checks);
  json result = {{"frames", record.frames},
                 {"frames_lost", record.frames_lost},
                 {"samples", record.samples},
                 {"occluded_share", record.occluded_share},
                 {"started_at_rest", record.started_at_rest},
                 {"rest_s", record.rest_s},
                 {"attempts", record.attempts}};
  if (file_.checks.drift) {
    const CalibrationWatch watch =
        watch_calibration(trial::read_campaign(folder / step.trial), [](double, const std::string&) {});
    result["camera"] = watch.camera.sentence;
    result["projector"] = watch.projector.sentence;
    drifted_ = watch.moved();
    if (drifted_) throw CheckFailed(watch.camera.since ? watch.camera.sentence : watch.projector.sentence);
  }
  return result;
}

// Of the trials that are there: some may have been skipped.
void StationSteps::write_campaign(const Step& step) {
  const SwatchPlan& swatch = file_.fabrics[step.fabric];
  std::vector<std::string> names;
  const auto take = [&](const session::SessionPlan& plan) {
    for (const session::TrialPlan& trial : plan.trials) {
      Step recorded{"record", step.fabric, trial.name, 0, 0, step.second};
      if (journal_.record(recorded.id(file_)).state == StepRecord::State::done) names.push_back(trial.name);
    }
  };
  take(plan_of(Step{step.kind, step.fabric, "", 0, 0, step.second}));
  const auto appended = appended_.find(step.fabric);
  if (step.round > 0 && appended != appended_.end()) take(appended->second);
  if (names.empty()) throw DeviceFailed("no trial was recorded");
  std::vector<std::vector<std::string>> replicates = swatch.replicates;
  for (std::vector<std::string>& same : replicates)
    std::erase_if(same,
                  [&](const std::string& name) { return std::find(names.begin(), names.end(), name) == names.end(); });
  std::erase_if(replicates, [](const auto& same) { return same.size() < 2; });
  write_session_campaign(swatch.name, names, replicates, trials_folder(step));
}

void StationSteps::prepare(const Step& step) {
  if (step.round == 0) let_go_of_rig();
  write_campaign(step);
}

void StationSteps::set_aside(const Step& step) {
  if (step.kind != "record") return;
  const fs::path trial = trials_folder(step) / step.trial;
  if (fs::exists(trial / "trial.json")) capture::recover(trial);
  session::set_trial_aside(trials_folder(step), step.trial);
  // A rig whose processes ended is started anew.
  try {
    if (simulated_) simulated_->require_running();
  } catch (const std::runtime_error& error) {
    spdlog::warn("{}", error.what());
    rig_.reset();
    simulated_.reset();
  }
}

Answer StationSteps::ask(const std::string& question) {
  session::Terminal terminal;
  terminal.say(question);
  if (desk_) desk_->take_answer(0);
  selvedge_rig::operator_prompt_t prompt{};
  prompt.step = "ask";
  prompt.text = question;
  const double until_s = rig::host_now_s() + kAnswer_s;
  prompt.prompt_id = rig::host_now_us();
  while (rig::host_now_s() < until_s) {
    prompt.utime = rig::host_now_us();
    if (desk_) desk_->bus.publish(rig::kOperatorPrompt, prompt);
    std::string answer = desk_ ? desk_->take_answer(prompt.prompt_id) : "";
    if (const std::string typed = terminal.line(500); !typed.empty()) answer = typed;
    if (answer == "repeat") return Answer::repeat;
    if (answer == "skip") return Answer::skip;
    if (answer == "stop") return Answer::stop;
  }
  return Answer::stop;
}

void StationSteps::tell(const Step& step, double done, const std::string& message) {
  if (!desk_ || (rig::host_now_s() - told_s_ < kTell_s && done > 0)) return;
  told_s_ = rig::host_now_s();
  selvedge_rig::session_status_t status{};
  status.utime = rig::host_now_us();
  status.step = step.id(file_);
  status.trial = step.trial;
  status.done = done;
  status.message = message;
  desk_->bus.publish(rig::kSessionStatus, status);
}

}  // namespace selvedge::station
