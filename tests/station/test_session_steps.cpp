// The order of a session's steps, what happens when one fails, and that a session killed in any phase goes on from
// there.
#include "station/session_steps.h"

#include <csignal>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::station {
namespace {

namespace fs = std::filesystem;

// Writes down what it is asked; fails or dies where it is told to.
class FakeSteps : public SessionSteps {
 public:
  FakeSteps(const SessionFile& file, fs::path folder) : file_(file), folder_(std::move(folder)) {}

  nlohmann::json run(const Step& step, const report::ProgressCallback& progress) override {
    const std::string id = step.id(file_);
    note("run " + id);
    progress(0.5, "half");
    if (id == dies_in) ::kill(::getpid(), SIGKILL);
    if (id == refuses) throw BadInput("trial.json: found nothing");
    if (failures[id]-- > 0) throw std::runtime_error("it broke");
    note("end " + id);
    return {{"of", id}};
  }
  void set_aside(const Step& step) override { note("aside " + step.id(file_)); }
  std::vector<Step> follow_up(const Step& diagnosed) override {
    if (!proposes) return {};
    return {{"record", diagnosed.fabric, "next-1", diagnosed.round + 1, 1},
            {"diagnose", diagnosed.fabric, "", diagnosed.round + 1, 1}};
  }

  std::vector<Step> second_session(const Step& diagnosed) override {
    if (!names_an_effect) return {};
    return {{"record", diagnosed.fabric, "second-1", 0, 1, true}, {"confirm", diagnosed.fabric, "", 0, 1, true}};
  }

  std::map<std::string, int> failures;
  std::string dies_in, refuses;
  bool proposes = false, names_an_effect = false;

 private:
  void note(const std::string& line) { std::ofstream(folder_ / "notes", std::ios::app) << line << '\n'; }
  const SessionFile& file_;
  const fs::path folder_;
};

class SessionStepsTest : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    for (const char* name : {"knit", "satin"}) {
      SwatchPlan swatch;
      swatch.name = name;
      swatch.plan.trials.resize(2);
      swatch.plan.trials[0].name = "still";
      swatch.plan.trials[1].name = "waved";
      file_.fabrics.push_back(swatch);
    }
    file_.text = "a session";
    for (const char* kind : {"calibrate", "record", "fit", "diagnose", "confirm"})
      file_.on_failure[kind] = {1, OnFailure::Then::stop};
  }
  void TearDown() override { fs::remove_all(folder_); }

  void run(
      FakeSteps& steps, const AskOperator& ask = [](const std::string&) { return Answer::stop; }) {
    Journal journal(folder_, file_.text);
    shown_.clear();
    run_steps(file_, journal, steps, ask,
              [this](double done, const std::string& what) { shown_.emplace_back(done, what); });
  }
  // A run that is killed in this phase.
  void kill_in(const std::string& phase, bool names_an_effect = false) {
    const pid_t child = ::fork();
    if (child == 0) {
      FakeSteps steps(file_, folder_);
      steps.names_an_effect = names_an_effect;
      steps.dies_in = phase;
      try {
        run(steps);
      } catch (...) {}
      ::_exit(1);  // not reached: it dies before
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) << phase;
  }
  std::vector<std::string> notes() const {
    std::ifstream file(folder_ / "notes");
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
  }
  long count(const std::string& line) const {
    const auto all = notes();
    return std::count(all.begin(), all.end(), line);
  }

  SessionFile file_;
  std::vector<std::pair<double, std::string>> shown_;  // of the last run: progress
  const fs::path folder_ = fs::temp_directory_path() / fmt::format("selvedge-session-steps-{}", ::getpid());
};

TEST_F(SessionStepsTest, GoesOnAfterAKillInEveryPhase) {
  const std::vector<std::string> phases = {"calibrate", "knit/record/waved", "satin/record/still", "knit/fit",
                                           "satin/diagnose"};
  for (const std::string& phase : phases) {
    ASSERT_NO_FATAL_FAILURE(kill_in(phase));
    EXPECT_EQ(read_journal(folder_).at(phase).state, StepRecord::State::begun);
  }
  FakeSteps steps(file_, folder_);
  run(steps);
  for (const Step& step : planned_steps(file_)) {
    const std::string id = step.id(file_);
    EXPECT_EQ(count("end " + id), 1) << id;
    const bool killed = std::find(phases.begin(), phases.end(), id) != phases.end();
    EXPECT_EQ(count("run " + id), killed ? 2 : 1) << id;
    EXPECT_EQ(count("aside " + id), killed ? 1 : 0) << id;
    EXPECT_EQ(read_journal(folder_).at(id).result.at("of"), id);
  }
  run(steps);  // nothing is left to do
  EXPECT_EQ(count("run knit/fit"), 2);
}

TEST_F(SessionStepsTest, RepeatsThenSkipsOrAsksOrStops) {
  file_.on_failure["record"] = {2, OnFailure::Then::skip};
  file_.on_failure["fit"] = {0, OnFailure::Then::ask};
  FakeSteps steps(file_, folder_);
  steps.failures = {
      {"knit/record/still", 2}, {"knit/record/waved", 9}, {"knit/fit", 1}, {"satin/fit", 1}, {"satin/diagnose", 2}};
  std::vector<std::string> questions;
  const AskOperator ask = [&](const std::string& question) {
    questions.push_back(question);
    return questions.size() == 1 ? Answer::repeat : Answer::skip;
  };
  EXPECT_THROW(run(steps, ask), SessionStopped);
  const auto journal = read_journal(folder_);
  EXPECT_EQ(journal.at("knit/record/still").state, StepRecord::State::done);
  EXPECT_EQ(journal.at("knit/record/still").attempts, 3);
  EXPECT_EQ(count("aside knit/record/still"), 2);
  EXPECT_EQ(journal.at("knit/record/waved").state, StepRecord::State::skipped);
  EXPECT_EQ(journal.at("knit/record/waved").attempts, 3);
  EXPECT_EQ(journal.at("knit/fit").state, StepRecord::State::done);
  EXPECT_EQ(journal.at("satin/fit").state, StepRecord::State::skipped);
  ASSERT_EQ(questions.size(), 2u);
  EXPECT_NE(questions[0].find("knit/fit failed: it broke"), std::string::npos) << questions[0];
  EXPECT_EQ(journal.at("satin/diagnose").state, StepRecord::State::failed);
  // Run again, it goes on at the step that failed.
  run(steps, ask);
  EXPECT_EQ(read_journal(folder_).at("satin/diagnose").state, StepRecord::State::done);
  EXPECT_EQ(count("run knit/fit"), 2);
}

TEST_F(SessionStepsTest, BadInputIsNotRepeatedAndTheRestGoesOn) {
  file_.on_failure["fit"] = {5, OnFailure::Then::skip};
  FakeSteps steps(file_, folder_);
  steps.refuses = "knit/fit";
  run(steps);
  EXPECT_EQ(count("run knit/fit"), 1);
  EXPECT_EQ(read_journal(folder_).at("knit/fit").state, StepRecord::State::skipped);
  EXPECT_EQ(count("end satin/diagnose"), 1);
}

TEST_F(SessionStepsTest, AppendsWhatADiagnosisProposes) {
  file_.follow_up = 1;
  FakeSteps steps(file_, folder_);
  steps.proposes = true;
  run(steps);
  EXPECT_EQ(count("end knit/record/next-1"), 1);
  EXPECT_EQ(count("end satin/diagnose-2"), 1);
  EXPECT_EQ(count("run knit/diagnose-3"), 0);
}

TEST_F(SessionStepsTest, ConfirmsByASecondSessionAndGoesOnInIt) {
  file_.confirm = true;
  ASSERT_NO_FATAL_FAILURE(kill_in("satin/second/second-1", true));
  FakeSteps steps(file_, folder_);
  steps.names_an_effect = true;
  run(steps);
  for (const char* fabric : {"knit", "satin"}) {
    EXPECT_EQ(count(std::string("end ") + fabric + "/diagnose"), 1);
    EXPECT_EQ(count(std::string("end ") + fabric + "/second/second-1"), 1);
    EXPECT_EQ(count(std::string("end ") + fabric + "/confirm"), 1);
  }
  EXPECT_EQ(count("aside satin/second/second-1"), 1);
  EXPECT_EQ(count("run knit/second/second-1"), 1);
}

TEST_F(SessionStepsTest, IsNotDoneBeforeItsSecondSessionIs) {
  file_.confirm = true;
  FakeSteps steps(file_, folder_);
  steps.names_an_effect = true;
  run(steps);
  ASSERT_FALSE(shown_.empty());
  for (size_t i = 1; i < shown_.size(); ++i) EXPECT_GE(shown_[i].first, shown_[i - 1].first) << shown_[i].second;
  EXPECT_EQ(shown_.back().first, 1);
  shown_.pop_back();
  EXPECT_LT(shown_.back().first, 1) << shown_.back().second;
  EXPECT_EQ(shown_.back().second, "satin/confirm: half");
}

TEST_F(SessionStepsTest, RecordsNothingMoreWhereNobodyAskedOrNothingIsNamed) {
  FakeSteps steps(file_, folder_);
  steps.names_an_effect = true;
  run(steps);
  EXPECT_EQ(count("run knit/confirm"), 0);
  fs::remove_all(folder_);
  fs::create_directories(folder_);
  file_.confirm = true;
  steps.names_an_effect = false;
  run(steps);
  EXPECT_EQ(count("end knit/diagnose"), 1);
  EXPECT_EQ(count("run knit/confirm"), 0);
}

TEST_F(SessionStepsTest, TwoDoNotShareAFolderAndAnotherFileIsRefused) {
  {
    const Journal held(folder_, file_.text);
    EXPECT_THROW(Journal(folder_, file_.text), BadInput);
  }
  EXPECT_THROW(Journal(folder_, "another session"), BadInput);
  EXPECT_NO_THROW(Journal(folder_, file_.text));
}

TEST_F(SessionStepsTest, PassesOverATornLastLine) {
  { Journal(folder_, file_.text).done("calibrate", 1, {{"a", 1}}); }
  std::ofstream(folder_ / "journal.jsonl", std::ios::app) << "{\"step\": \"knit/fi";
  EXPECT_EQ(read_journal(folder_).size(), 1u);
  Journal journal(folder_, file_.text);
  journal.begun("knit/fit");
  EXPECT_EQ(read_journal(folder_).at("knit/fit").state, StepRecord::State::begun);
}

}  // namespace
}  // namespace selvedge::station
