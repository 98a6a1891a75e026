// What is recorded, damaged, and then checked, recovered and fitted by the binary; and the proof that durable is
// durable.
#include <algorithm>
#include <memory>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "capture/recorder.h"
#include "capture/trial/checked_trial.h"
#include "cli/verify/proofs/damaged_trials.h"
#include "tests/cli/run_binary.h"
#include "cli/verify/proofs/simulated_trial.h"

namespace selvedge::cli {
namespace {

namespace fs = std::filesystem;

class RecoverCommand : public testing::Test {
 protected:
  void SetUp() override { fs::create_directory(folder()); }
  fs::path folder() const { return scratch_.path() / "work"; }
  Ran run(const std::string& arguments) { return run_binary(arguments, folder()); }

  // A waved swatch as a recorder leaves it.
  std::unique_ptr<capture::Recorder> record(const std::string& name) {
    cloth::Material material;
    material.density = 0.16;
    material.stretch = 60;
    material.shear = 6;
    material.bend = 1e-5;
    SimulatedMotion motion;
    motion.amplitude_m = 0.05;
    motion.samples = 61;
    const trial::Trial t = simulated_trial({material}, motion, name, 4);
    auto recorder = std::make_unique<capture::Recorder>(t, folder() / name);
    for (size_t i = 0; i < t.corners.time_s.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      recorder->add_corners(t.corners.time_s[i], t.corners.left.col(column), t.corners.right.col(column));
    }
    for (size_t i = 0; i < t.markers->time_s.size(); ++i)
      recorder->add_marker(t.markers->time_s[i], t.markers->marker[i], t.markers->uv[i],
                           t.markers->position.col(static_cast<Eigen::Index>(i)));
    return recorder;
  }

  // Zeros over lines `first` to `last` of a table, as a lost block leaves them.
  void lose_lines(const fs::path& path, size_t first, size_t last) const {
    std::string text = files::read_whole(path);
    size_t from = 0, to = 0;
    for (size_t line = 1; line < first; ++line) from = text.find('\n', from) + 1;
    for (size_t line = 1; line <= last; ++line) to = text.find('\n', to) + 1;
    std::fill(text.begin() + static_cast<std::ptrdiff_t>(from), text.begin() + static_cast<std::ptrdiff_t>(to - 1),
              '\0');
    files::write_whole(path, text);
  }

  ScratchFolder scratch_;
};

TEST_F(RecoverCommand, ADamagedTrialIsCheckedRecoveredAndFittedWithoutWhatIsDamaged) {
  record("waving")->finish();
  lose_lines(folder() / "waving" / "corners.csv", 20, 25);
  lose_lines(folder() / "waving" / "markers.csv", 100, 140);
  const std::string corners = "corners.csv: line 20 damaged, 55 of 61 rows read";
  const Ran check = run("check waving");
  EXPECT_EQ(check.exit_status, 0) << check.err;
  EXPECT_NE(check.out.find("damaged: waving: " + corners), std::string::npos) << check.out;
  const Ran recover = run("recover waving");
  EXPECT_EQ(recover.exit_status, 0) << recover.err;
  EXPECT_NE(recover.out.find("gap: " + corners), std::string::npos) << recover.out;
  EXPECT_NE(recover.out.find("kept: 55 corner samples"), std::string::npos) << recover.out;
  EXPECT_NE(recover.out.find("gap: markers.csv: line 100 damaged"), std::string::npos) << recover.out;
  const Ran fit = run("fit waving --cells 6 --out fitted");
  EXPECT_EQ(fit.exit_status, 0) << fit.err;
  EXPECT_NE(fit.err.find(corners), std::string::npos) << fit.err;
  EXPECT_TRUE(fs::exists(folder() / "fitted" / "fit.json"));
}

TEST_F(RecoverCommand, OfAFolderEachTrialAndOneThatIsBeingRecordedIsRefused) {
  record("done")->finish();
  const auto going_on = record("going-on");
  const Ran busy = run("recover going-on");
  EXPECT_EQ(busy.exit_status, 2);
  EXPECT_NE(busy.err.find("being recorded"), std::string::npos) << busy.err;
  // A copy is what a killed recorder would leave: nobody holds it.
  fs::copy(folder() / "going-on", folder() / "killed", fs::copy_options::recursive);
  const Ran all = run("recover .");
  EXPECT_EQ(all.exit_status, 2);
  EXPECT_NE(all.out.find("done: complete, nothing to mend"), std::string::npos) << all.out;
  EXPECT_NE(all.out.find("killed: cut, mended"), std::string::npos) << all.out;
  EXPECT_NE(all.err.find("going-on"), std::string::npos) << all.err;
  EXPECT_EQ(std::count(all.err.begin(), all.err.end(), '\n'), 1) << all.err;
}

TEST_F(RecoverCommand, RefusesWhatIsNoTrialAndPutsTrialJsonBack) {
  fs::create_directory(folder() / "empty");
  for (const char* what : {"empty", "nowhere"}) {
    const Ran ran = run(fmt::format("recover {}", what));
    EXPECT_EQ(ran.exit_status, 2);
    EXPECT_NE(ran.err.find(what), std::string::npos) << ran.err;
  }
  record("waving")->finish();
  files::write_whole(folder() / "waving" / "trial.json", "");
  EXPECT_EQ(run("check waving").exit_status, 2);
  const Ran ran = run("recover waving");
  EXPECT_EQ(ran.exit_status, 0) << ran.err;
  EXPECT_NE(ran.out.find("put back from trial-copy.json"), std::string::npos) << ran.out;
  EXPECT_EQ(run("check waving").exit_status, 0);
  files::write_whole(folder() / "waving" / "trial.json", "");
  files::write_whole(folder() / "waving" / trial::copy_name, "{");
  const Ran gone = run("recover waving");
  EXPECT_EQ(gone.exit_status, 2);
  EXPECT_NE(gone.err.find("61 rows of corners.csv"), std::string::npos) << gone.err;
}

TEST_F(RecoverCommand, WhateverWasCalledDurableReadsAfterSixtyPowerCuts) {
  const Ran proof = run("prove recorder --quick");
  EXPECT_EQ(proof.exit_status, 0) << proof.err << proof.out;
  EXPECT_NE(proof.out.find("every figure holds"), std::string::npos) << proof.out;
}

}  // namespace
}  // namespace selvedge::cli
