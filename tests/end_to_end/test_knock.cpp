// A camera that is knocked between two trials of `./selvedge session run`: the trial after it fails its check, is kept
// aside, and is recorded again once the rig has been calibrated anew.
#include <filesystem>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "capture/trial/trial.h"
#include "files/whole_file.h"
#include "station/calibration_watch.h"
#include "station/journal.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;
using station::StepRecord;

TEST(KnockedSession, TheTrialAfterAKnockIsKeptAsideAndRecordedAgain) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("selvedge-knock-{}", ::getpid());
  fs::remove_all(folder);
  fs::create_directories(folder);
  const fs::path file = fs::path(SELVEDGE_SOURCE_DIR) / "tests" / "end_to_end" / "knocked-session.toml";
  const int status =
      std::system(fmt::format("'{}' session run '{}' --out '{}' > '{}' 2>&1 < /dev/null", SELVEDGE_BINARY,
                              file.string(), (folder / "run").string(), (folder / "output").string())
                      .c_str());
  ASSERT_EQ(status, 0) << files::read_whole(folder / "output");

  // A busy machine may spoil an attempt before: the knock then falls into the first trial, and is noticed there.
  const auto journal = station::read_journal(folder / "run");
  std::string knocked;
  for (const char* trial : {"static-1", "static-2"}) {
    const StepRecord& record = journal.at(fmt::format("knit/record/{}", trial));
    EXPECT_EQ(record.state, StepRecord::State::done) << trial;
    if (record.why.find("The camera has moved") != std::string::npos) knocked = trial;
  }
  ASSERT_FALSE(knocked.empty()) << files::read_whole(folder / "output");
  const StepRecord& record = journal.at("knit/record/" + knocked);
  EXPECT_GE(record.attempts, 2);
  EXPECT_NE(record.result.at("camera").get<std::string>().find("stands where it was calibrated"), std::string::npos)
      << record.result.dump();

  // What was kept aside shows the knock by the calibration that it carries; what counts stands by a new one.
  const fs::path knit = folder / "run" / "knit";
  const auto quiet = [](double, const std::string&) {};
  ASSERT_TRUE(fs::exists(knit / (knocked + "-spoiled-1")));
  const trial::Trial good = trial::read_trial(knit / knocked);
  EXPECT_FALSE(station::watch_calibration(trial::read_campaign(knit / knocked), quiet).moved());
  bool shown = false;
  for (int k = 1; fs::exists(knit / fmt::format("{}-spoiled-{}", knocked, k)); ++k) {
    const fs::path aside = knit / fmt::format("{}-spoiled-{}", knocked, k);
    if (trial::read_trial(aside).state != trial::State::complete) continue;  // spoiled by the machine, not by the knock
    shown = shown || (station::watch_calibration(trial::read_campaign(aside), quiet).camera.since &&
                      (trial::read_trial(aside).camera->matrix - good.camera->matrix).norm() > 1);
  }
  EXPECT_TRUE(shown);
  const auto summary = files::read_json(folder / "run" / "session.json");
  EXPECT_FALSE(summary.at("fabrics").at("knit").at("trials").at(knocked).at("kept_aside").empty());
  if (!HasFailure()) fs::remove_all(folder);
}

}  // namespace
}  // namespace selvedge
