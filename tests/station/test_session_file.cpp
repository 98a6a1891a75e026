// The session file: what is read of it, and what is refused by name.
#include "station/session_file.h"

#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "files/whole_file.h"
#include "station/session_steps.h"
#include "tests/refusal.h"

namespace selvedge::station {
namespace {

namespace fs = std::filesystem;

class SessionFileTest : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    const fs::path examples = fs::path(SELVEDGE_SOURCE_DIR) / "examples";
    fs::copy_file(examples / "demo-rig.toml", folder_ / "rig.toml", fs::copy_options::overwrite_existing);
    fs::copy_file(examples / "demo-world.toml", folder_ / "world.toml", fs::copy_options::overwrite_existing);
  }
  void TearDown() override { fs::remove_all(folder_); }

  SessionFile read(const std::string& text) {
    files::write_whole(folder_ / "session.toml", text);
    return read_session_file(folder_ / "session.toml");
  }
  // The refusal's text; empty where there is none.
  std::string refusal(const std::string& text) {
    return refusal_of([&] { read(text); });
  }

  const fs::path folder_ = fs::temp_directory_path() / fmt::format("selvedge-session-file-{}", ::getpid());
  const std::string session_ =
      "[session]\nrig = \"rig.toml\"\nworld = \"world.toml\"\nfabrics = [\"knit\", \"satin\"]\ntrials = [\"still\", "
      "\"waved\"]\n"
      "[session.still]\nkind = \"static\"\nduration_s = 1\n[session.waved]\nkind = \"waving\"\nduration_s = 3\nrepeats "
      "= 2\n";
  const std::string fabrics_ =
      "[fabric.knit]\nwidth_m = 0.3\nheight_m = 0.3\nmass_kg = 0.015\n[fabric.satin]\nwidth_m = 0.25\nheight_m = "
      "0.3\nmass_kg = 0.01\n"
      "world = {bend = 3e-5, effect = \"tied_thread\", strength = 1.0}\n";
};

TEST_F(SessionFileTest, ReadsFabricsTrialsAndRepeats) {
  const SessionFile file = read(session_ + fabrics_ + "[on_failure]\nrecord = \"repeat 4, ask\"\nfit = \"skip\"\n");
  ASSERT_EQ(file.fabrics.size(), 2u);
  EXPECT_EQ(file.fabrics[1].plan.fabric.name, "satin");
  EXPECT_EQ(file.fabrics[1].plan.fabric.width_m, 0.25);
  ASSERT_EQ(file.fabrics[0].plan.trials.size(), 3u);
  EXPECT_EQ(file.fabrics[0].plan.trials[1].name, "waved-1");
  EXPECT_EQ(file.fabrics[0].plan.trials[2].name, "waved-2");
  EXPECT_EQ(file.fabrics[0].replicates, (std::vector<std::vector<std::string>>{{"waved-1", "waved-2"}}));
  EXPECT_EQ(file.fabrics[0].plan.stripes.period_px, 16);  // from the rig's own file
  EXPECT_EQ(file.on_failure.at("record").repeats, 4);
  EXPECT_EQ(file.on_failure.at("record").then, OnFailure::Then::ask);
  EXPECT_NE(file.simulated_world.find("tied_thread"), std::string::npos);

  std::vector<std::string> ids;
  for (const Step& step : planned_steps(file)) ids.push_back(step.id(file));
  EXPECT_EQ(ids,
            (std::vector<std::string>{"calibrate", "knit/record/still", "knit/record/waved-1", "knit/record/waved-2",
                                      "satin/record/still", "satin/record/waved-1", "satin/record/waved-2", "knit/fit",
                                      "knit/diagnose", "satin/fit", "satin/diagnose"}));
}

TEST_F(SessionFileTest, ARigsOwnConfigurationIsASessionOfItsTrialsInPlace) {
  const SessionFile file = session_of_rig(folder_ / "rig.toml", folder_ / "world.toml");
  std::vector<std::string> kinds;
  for (const Step& step : planned_steps(file)) kinds.push_back(step.kind);
  ASSERT_EQ(file.fabrics.size(), 1u);
  std::vector<std::string> expected(1 + file.fabrics[0].plan.trials.size(), "record");
  expected[0] = "calibrate";
  EXPECT_EQ(kinds, expected);
  for (const std::string& kind : kinds) EXPECT_EQ(file.on_failure.at(kind).repeats, 0) << kind;
  EXPECT_EQ(file.folder_of(0, "runs/demo"), "runs/demo");
  EXPECT_EQ(read(session_ + fabrics_).folder_of(1, "runs/two"), "runs/two/satin");
}

TEST_F(SessionFileTest, RefusesByName) {
  EXPECT_EQ(refusal(session_ + fabrics_), "");
  EXPECT_NE(refusal(session_ + fabrics_ + "[fit]\ncolumn = 13\n").find("[fit] column: unknown key"), std::string::npos)
      << refusal(session_ + fabrics_ + "[fit]\ncolumn = 13\n");
  EXPECT_NE(refusal(session_ + fabrics_ + "[diagnose]\nrun = true\n").find("diagnose"), std::string::npos);
  EXPECT_NE(refusal(session_).find("no section [fabric.knit]"), std::string::npos) << refusal(session_);
  EXPECT_NE(refusal(session_ + fabrics_ + "[fabric.linen]\nwidth_m = 0.3\n").find("linen"), std::string::npos);
  EXPECT_NE(refusal(session_ + "[session.robot-9]\nkind = \"robot\"\n" + fabrics_).find("robot-9"), std::string::npos);
  EXPECT_NE(refusal(session_ + fabrics_ + "[on_failure]\nfit = \"repeat, skip\"\n").find("fit"), std::string::npos);
  EXPECT_NE(refusal(session_ + fabrics_ + "[on_failure]\ncalibrate = \"skip\"\n").find("nothing can be recorded"),
            std::string::npos);
  EXPECT_NE(refusal(session_ + fabrics_ + "[on_failure]\nhang = \"skip\"\n").find("unknown step"), std::string::npos);
  EXPECT_NE(
      refusal(session_ + fabrics_ + "[calibration]\nwhen = \"reuse\"\nfile = \"nowhere.json\"\n").find("nowhere.json"),
      std::string::npos);
  EXPECT_NE(refusal("[session]\nrig = \"rig.toml\"\nfabrics = [\"../x\"]\ntrials = []\n" + fabrics_).find("../x"),
            std::string::npos);
}

TEST_F(SessionFileTest, ASecondSessionNeedsAFitAndADiagnosis) {
  EXPECT_FALSE(read(session_ + fabrics_).confirm);
  EXPECT_TRUE(read(session_ + fabrics_ + "[diagnosis]\nconfirm = true\n").confirm);
  EXPECT_NE(
      refusal(session_ + fabrics_ + "[fit]\nrun = false\n[diagnosis]\nconfirm = true\n").find("[diagnosis] confirm"),
      std::string::npos);
  EXPECT_NE(refusal(session_ + fabrics_ + "[diagnosis]\nrun = false\nconfirm = true\n").find("[diagnosis] confirm"),
            std::string::npos);
}

TEST_F(SessionFileTest, ReadsTheExample) {
  const SessionFile file = read_session_file(fs::path(SELVEDGE_SOURCE_DIR) / "examples" / "four-fabrics.toml");
  EXPECT_EQ(file.fabrics.size(), 4u);
}

}  // namespace
}  // namespace selvedge::station
