#include "station/session_steps.h"

#include <algorithm>
#include <chrono>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>

#include "files/bad_input.h"
#include "station/rig_steps.h"

namespace selvedge::station {

namespace {

using State = StepRecord::State;

double since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// What is to happen after an attempt failed.
Answer after_failure(const Step& step, const std::string& id, const OnFailure& policy, int failures,
                     const std::string& why, const AskOperator& ask) {
  if (failures <= policy.repeats) return Answer::repeat;
  if (policy.then == OnFailure::Then::skip) return Answer::skip;
  if (policy.then == OnFailure::Then::stop) return Answer::stop;
  const Answer answer = ask(fmt::format("{} failed: {}. repeat, skip or stop?", id, why));
  return answer == Answer::skip && step.kind == "calibrate" ? Answer::stop : answer;
}

// Until the step is done or skipped.
void run_step(const SessionFile& file, const Step& step, Journal& journal, SessionSteps& steps, const AskOperator& ask,
              const report::ProgressCallback& progress) {
  const std::string id = step.id(file);
  if (journal.record(id).state == State::begun || journal.record(id).state == State::failed) steps.set_aside(step);
  for (int failures = 0;;) {
    journal.begun(id);
    const auto begin = std::chrono::steady_clock::now();
    try {
      const nlohmann::json result = steps.run(step, progress);
      journal.done(id, since(begin), result);
      return;
    } catch (const std::exception& error) {
      const std::string why = error.what();
      spdlog::warn("{}: {}", id, why);
      journal.failed(id, since(begin), why);
      steps.set_aside(step);
      const OnFailure& policy = file.on_failure.at(step.kind);
      // What the input is at fault for fails again: no repetition mends it.
      failures = dynamic_cast<const BadInput*>(&error) != nullptr ? policy.repeats + 1 : failures + 1;
      switch (after_failure(step, id, policy, failures, why, ask)) {
        case Answer::repeat: break;
        case Answer::skip: return journal.skipped(id, why);
        case Answer::stop: throw SessionStopped(fmt::format("{}: {}", id, why));
      }
    }
  }
}

// What is left from step i on, and a second session of each diagnosis that may ask for one.
double expected_s(const SessionFile& file, const std::vector<Step>& queue, size_t i) {
  double sum = 0;
  for (; i < queue.size(); ++i) {
    sum += queue[i].expected_s;
    if (file.confirm && queue[i].kind == "diagnose" && queue[i].round == 0) sum += kSecondTrial_s + kConfirm_s;
  }
  return sum;
}

}  // namespace

std::string Step::id(const SessionFile& file) const {
  const std::string& name = file.fabrics[fabric].name;
  if (kind == "calibrate") return file.calibration == CalibrationPolicy::each ? name + "/calibrate" : kind;
  if (second && kind == "record") return fmt::format("{}/second/{}", name, trial);
  if (kind == "record") return fmt::format("{}/record/{}", name, trial);
  return round == 0 ? fmt::format("{}/{}", name, kind) : fmt::format("{}/{}-{}", name, kind, round + 1);
}

std::vector<Step> planned_steps(const SessionFile& file) {
  std::vector<Step> steps;
  for (size_t i = 0; i < file.fabrics.size(); ++i) {
    const session::SessionPlan& plan = file.fabrics[i].plan;
    const bool calibrates =
        file.calibration == CalibrationPolicy::each || (file.calibration == CalibrationPolicy::once && i == 0);
    if (calibrates) steps.push_back({"calibrate", i, "", 0, expected_calibration_s(plan)});
    for (const session::TrialPlan& trial : plan.trials)
      steps.push_back({"record", i, trial.name, 0, expected_trial_s(trial)});
  }
  for (size_t i = 0; i < file.fabrics.size(); ++i) {
    if (file.fit) steps.push_back({"fit", i, "", 0, kFit_s});
    if (file.diagnosis) steps.push_back({"diagnose", i, "", 0, kDiagnosis_s});
  }
  return steps;
}

void run_steps(const SessionFile& file, Journal& journal, SessionSteps& steps, const AskOperator& ask,
               const report::ProgressCallback& progress) {
  constexpr double kAlmost = 0.99;  // a diagnosis may ask for more
  std::vector<Step> queue = planned_steps(file);
  double at_s = 0;
  for (size_t i = 0; i < queue.size(); ++i) {
    const Step step = queue[i];
    const std::string id = step.id(file);
    const double total_s = at_s + expected_s(file, queue, i);
    const State state = journal.record(id).state;
    if (state != State::done && state != State::skipped)
      run_step(file, step, journal, steps, ask, [&](double done, const std::string& what) {
        progress(std::min(kAlmost, (at_s + done * step.expected_s) / total_s), id + ": " + what);
      });
    at_s += step.expected_s;
    if (step.kind != "diagnose" || journal.record(id).state != State::done) continue;
    if (step.round < file.follow_up)
      for (const Step& next : steps.follow_up(step)) queue.push_back(next);
    if (step.round == 0 && file.confirm)
      for (const Step& next : steps.second_session(step)) queue.push_back(next);
  }
  progress(1, "done");
}

}  // namespace selvedge::station
