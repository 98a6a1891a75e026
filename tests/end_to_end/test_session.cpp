// `./selvedge session run` on the simulated rig, killed once in every phase, and started again each time.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "capture/trial/trial.h"
#include "files/whole_file.h"
#include "rig/clock.h"
#include "station/journal.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;
using station::StepRecord;

class Session : public testing::Test {
 protected:
  const fs::path folder_ = fs::temp_directory_path() / fmt::format("selvedge-session-{}", ::getpid());

  pid_t start() {
    const pid_t child = ::fork();
    if (child != 0) return child;
    const fs::path file = fs::path(SELVEDGE_SOURCE_DIR) / "tests" / "end_to_end" / "short-session.toml";
    const std::string log = (folder_ / "output").string();
    if (std::freopen(log.c_str(), "a", stdout) == nullptr || ::dup2(1, 2) < 0) ::_exit(126);
    ::execl(SELVEDGE_BINARY, SELVEDGE_BINARY, "session", "run", file.c_str(), "--out", (folder_ / "run").c_str(),
            nullptr);
    ::_exit(127);
  }
  std::string output() const { return fs::exists(folder_ / "output") ? files::read_whole(folder_ / "output") : ""; }

  // Runs until the step has begun, and 0.7 s into it; true where it was killed there, false where the step ended
  // before.
  bool kill_in(const std::string& step) {
    const pid_t child = start();
    while (true) {
      int status = 0;
      if (::waitpid(child, &status, WNOHANG) == child) return false;
      const auto journal = station::read_journal(folder_ / "run");
      const auto found = journal.find(step);
      if (found != journal.end() && found->second.state == StepRecord::State::begun) break;
      ::usleep(50'000);
    }
    ::usleep(700'000);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    return station::read_journal(folder_ / "run").at(step).state == StepRecord::State::begun;
  }

  // A session, from its beginning; false where a step ended before it could be killed.
  bool kill_in_each_phase() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    for (const char* step : {"calibrate", "knit/record/waving-1", "knit/fit", "knit/diagnose"})
      if (!kill_in(step)) return false;
    return true;
  }
};

TEST_F(Session, SurvivesAKillInEachPhaseAndReports) {
  constexpr int kMostTries = 3;  // a machine may be too slow to kill a step in time
  for (int tries = 1; !kill_in_each_phase(); ++tries) ASSERT_LT(tries, kMostTries) << output();
  const pid_t child = start();
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 0) << output();

  const auto journal = station::read_journal(folder_ / "run");
  for (const char* step : {"calibrate", "knit/record/waving-1", "knit/fit", "knit/diagnose"}) {
    ASSERT_TRUE(journal.contains(step)) << step;
    EXPECT_EQ(journal.at(step).state, StepRecord::State::done) << step;
  }
  // Each was killed once and begun twice; what was done is not done again.
  for (const auto& [step, record] : journal) EXPECT_EQ(record.attempts, 2) << step;
  const trial::Campaign campaign = trial::read_campaign(folder_ / "run" / "knit");
  ASSERT_EQ(campaign.trials.size(), 1u);
  EXPECT_EQ(campaign.trials[0].state, trial::State::complete);
  EXPECT_EQ(campaign.trials[0].fabric.name, "knit");
  for (const char* file : {"fit.json", "report.html", "diagnosis/diagnosis.json", "simulated/waving-1.f32"})
    EXPECT_TRUE(fs::exists(folder_ / "run" / "knit" / file)) << file;
  const auto summary = files::read_json(folder_ / "run" / "session.json");
  EXPECT_EQ(summary.at("format"), "session/1");
  EXPECT_EQ(summary.at("fabrics").at("knit").at("truth").at("hidden"), "tied_thread");
  const auto& truth = summary.at("fabrics").at("knit").at("truth");
  EXPECT_TRUE(truth.at("names_it").get<bool>() || !truth.at("why_not").get<std::string>().empty()) << truth.dump(2);
  EXPECT_NE(files::read_whole(folder_ / "run" / "report.html").find("tied_thread"), std::string::npos);
  if (!HasFailure()) fs::remove_all(folder_);
}

}  // namespace
}  // namespace selvedge
