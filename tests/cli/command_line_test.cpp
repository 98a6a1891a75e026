#include <algorithm>
#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>

#include "capture/trial/trial_writer.h"
#include "cli/command.h"
#include "cli/verify/figure_command.h"
#include "cli/verify/proofs/damaged_trials.h"
#include "run_binary.h"

namespace selvedge::cli {
namespace {

namespace fs = std::filesystem;

class CommandLine : public testing::Test {
 protected:
  void SetUp() override { fs::create_directory(working_folder()); }

  fs::path working_folder() const { return scratch_.path() / "working"; }
  Ran run(const std::string& arguments) { return run_binary(arguments, working_folder()); }

  void expect_refused(const Ran& ran, const std::string& culprit) {
    EXPECT_EQ(ran.exit_status, 2) << ran.err;
    EXPECT_EQ(ran.out, "");
    EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << ran.err;
    EXPECT_EQ(ran.err.rfind("selvedge: ", 0), 0u) << ran.err;
    EXPECT_NE(ran.err.find(culprit), std::string::npos) << ran.err;
  }

  ScratchFolder scratch_;
};

TEST_F(CommandLine, ASlipOfTheHandIsAskedAbout) {
  expect_refused(run("diagnos x --out y"), "did you mean diagnose?");
  expect_refused(run("prov cloth"), "did you mean prove?");
  expect_refused(run("fit x --ouy y"), "did you mean --out?");
  const Ran ran = run("weave");
  expect_refused(ran, "weave");
  EXPECT_EQ(ran.err.find("did you mean"), std::string::npos) << ran.err;
}

TEST_F(CommandLine, AProcessorThatIsNotHereIsRefused) {
  ::setenv("SELVEDGE_PROCESSOR", "abacus", 1);
  expect_refused(run("check ."), "SELVEDGE_PROCESSOR: found \"abacus\", expected plain, avx2 or avx512");
  ::setenv("SELVEDGE_PROCESSOR", "plain", 1);
  EXPECT_EQ(run("--help").exit_status, 0);
  ::unsetenv("SELVEDGE_PROCESSOR");
}

TEST_F(CommandLine, HelpListsEveryCommand) {
  const Ran ran = run("--help");
  EXPECT_EQ(ran.exit_status, 0);
  EXPECT_EQ(ran.err, "");
  for (const char* command : {"check", "prove", "bench"}) EXPECT_NE(ran.out.find(command), std::string::npos);
  EXPECT_EQ(run("").out, ran.out);
  EXPECT_EQ(run("check --help").exit_status, 0);
}

TEST_F(CommandLine, RefusesWhatItDoesNotKnow) {
  expect_refused(run("sew"), "sew");
  expect_refused(run("check"), "PATH");
  expect_refused(run("check --loud x"), "");
  expect_refused(run("check nowhere"), "nowhere");
  expect_refused(run("check \"$(printf 'two\\nlines')\""), "two lines");
  expect_refused(run("fit nowhere --out fitted --evaluations 5"), "--evaluations");  // least squares has no budget
  expect_refused(run("compare . .. --out compared"), "neither fit.json nor diagnosis.json");
  expect_refused(run("console --run nowhere"), "nowhere");
  expect_refused(run("prove nothing"), "nothing");
  expect_refused(run("bench nothing"), "nothing");
  expect_refused(run("prove format --seed many"), "seed");
  expect_refused(run("prove format --json nowhere/f.json"), "nowhere");
  EXPECT_TRUE(fs::is_empty(working_folder()));
}

// Before any work: a diagnosis takes minutes to an hour.
TEST_F(CommandLine, AFileWhereAFolderIsToBeWrittenIsRefusedFirst) {
  std::ofstream(working_folder() / "taken") << "kept";
  for (const std::string out : {"taken", "taken/", "taken/below", "taken/below/deeper"})
    for (const std::string& command :
         {"diagnose . --out " + out, "fit . --out " + out, "experiment skirt --out " + out, "compare . . --out " + out,
          "garment x.toml --out " + out, "session run x.toml --out " + out, "watch . --out " + out,
          "calibrate . --out " + out, "blind make " + out + " --seed 1", "demo --runs " + out, "soak --runs " + out,
          "export . --obj " + out, "import x.toml --out " + out})
      EXPECT_NO_FATAL_FAILURE(expect_refused(run(command), out)) << command;
  EXPECT_EQ(files::read_whole(working_folder() / "taken"), "kept");
  EXPECT_EQ(std::distance(fs::directory_iterator(working_folder()), fs::directory_iterator()), 1);
  expect_refused(run("blind make bank --seed -1"), "--seed");
  EXPECT_FALSE(fs::exists(working_folder() / "bank"));
}

TEST_F(CommandLine, CheckSaysWhatATrialHolds) {
  const ExampleTrial example = example_trial(1);
  trial::write_trial(example.trial, scratch_.path() / "trial", example.images);
  const Ran ran = run("check ../trial");
  EXPECT_EQ(ran.exit_status, 0) << ran.err;
  EXPECT_EQ(ran.err, "");
  for (const char* part : {"robot", "top_edge_clamped", "0.3 x 0.3333 m", "16.2 g (guessed)", "60 samples", "120 Hz",
                           "right 15 %", "2 numbers missing", "4 markers, 60 times", "0.2 mm"})
    EXPECT_NE(ran.out.find(part), std::string::npos) << part << "\n" << ran.out;
}

TEST_F(CommandLine, CheckReadsACampaignAndNamesTheTrialItRefuses) {
  const ExampleTrial example = example_trial(1);
  trial::Campaign campaign;
  campaign.fabric = "silk";
  for (const char* name : {"static-1", "waving-1"}) {
    trial::write_trial(example.trial, scratch_.path() / "campaign" / name, example.images);
    campaign.trials.push_back(example.trial);
    campaign.trials.back().name = name;
  }
  campaign.replicates = {{"static-1", "waving-1"}};
  trial::write_campaign_json(campaign, scratch_.path() / "campaign");
  const Ran ran = run("check ../campaign");
  EXPECT_EQ(ran.exit_status, 0) << ran.err;
  for (const char* part : {"campaign of 2 trials", "same motion: static-1, waving-1", "top_edge_clamped"})
    EXPECT_NE(ran.out.find(part), std::string::npos) << part;
  fs::remove(scratch_.path() / "campaign/waving-1/frames/000005.png");
  expect_refused(run("check ../campaign"), "campaign/waving-1/frames.csv:5");
  campaign.replicates = {{"static-1", "waving-9"}};
  trial::write_campaign_json(campaign, scratch_.path() / "campaign");
  expect_refused(run("check ../campaign"), "waving-9");
}

// What lies in a folder: every path with its size and time of last writing.
std::string listing(const fs::path& folder) {
  std::vector<std::string> entries;
  if (fs::exists(folder))
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      const bool is_file = entry.is_regular_file();
      entries.push_back(entry.path().string() + " " + std::to_string(is_file ? entry.file_size() : 0) + " " +
                        std::to_string(entry.last_write_time().time_since_epoch().count()));
    }
  std::sort(entries.begin(), entries.end());
  std::string text;
  for (const std::string& entry : entries) text += entry + "\n";
  return text;
}

// `check` on every damage, and `fit` on one of each kind of file: one line, exit 2, nothing written.
TEST_F(CommandLine, EveryDamagedTrialIsRefusedInOneLineAndNothingIsWritten) {
  const ExampleTrial example = example_trial(1);
  const fs::path sound = scratch_.path() / "sound", trial = scratch_.path() / "trial";
  trial::write_trial(example.trial, sound, example.images);
  const std::string fit_ones =
      "trial.json cut in half,corners.csv cut in its last line,markers.csv empty,"
      "markers.csv filled with NaN,an image cut in half,an image too wide,corners.csv missing,"
      "an image missing,fabric.mass_kg zero,corners.csv: times go backwards,unknown format";
  for (const Damage& damage : damages()) {
    SCOPED_TRACE(damage.name);
    fs::remove_all(trial);
    fs::copy(sound, trial, fs::copy_options::recursive);
    damage.apply(trial);
    const std::string before = listing(trial);
    expect_refused(run("check ../trial"), damage.culprit);
    if (("," + fit_ones + ",").find("," + damage.name + ",") != std::string::npos)
      expect_refused(run("fit ../trial --out fitted"), damage.culprit);
    EXPECT_EQ(listing(trial), before);
    EXPECT_TRUE(fs::is_empty(working_folder()));
  }
}

TEST_F(CommandLine, OptionalPartsMayBeMissing) {
  const ExampleTrial example = example_trial(1);
  const fs::path sound = scratch_.path() / "sound", trial = scratch_.path() / "trial";
  trial::write_trial(example.trial, sound, example.images);
  for (const Damage& change : harmless_changes()) {
    SCOPED_TRACE(change.name);
    fs::remove_all(trial);
    fs::copy(sound, trial, fs::copy_options::recursive);
    change.apply(trial);
    const Ran ran = run("check ../trial");
    EXPECT_EQ(ran.exit_status, 0) << ran.err;
    EXPECT_EQ(ran.err, "");
  }
}

TEST_F(CommandLine, ProveAndBenchListRunAndWriteJson) {
  EXPECT_NE(run("prove").out.find("format"), std::string::npos);
  EXPECT_NE(run("bench").out.find("format"), std::string::npos);
  const Ran proof = run("prove format --quick --json proof.json");
  EXPECT_EQ(proof.exit_status, 0) << proof.err << proof.out;
  EXPECT_NE(proof.out.find("every figure holds"), std::string::npos);
  const nlohmann::json json = files::read_json(working_folder() / "proof.json");
  EXPECT_EQ(json["format"], "prove/1");
  EXPECT_EQ(json["holds"], true);
  EXPECT_GE(json["figures"].size(), 6u);
  EXPECT_EQ(run("bench format --quick --json bench.json").exit_status, 0);
  EXPECT_GT(files::read_json(working_folder() / "bench.json")["figures"][0]["measured"], 0);
}

// A set of one figure through the real command, in this process.
int exit_status_of(const Figure& figure, bool judged) {
  static std::vector<FigureSet> sets;
  sets = {{"one", "a figure", [figure](const FigureOptions&) { return std::vector<Figure>{figure}; }}};
  CLI::App app;
  int exit_status = -1;
  add_figure_command(app, "show", "", sets, judged, exit_status);
  testing::internal::CaptureStdout();
  app.parse("show one");
  testing::internal::GetCapturedStdout();
  return exit_status;
}

TEST(Figures, AProofThatFallsShortExitsOne) {
  const double nan = std::nan("");
  EXPECT_EQ(exit_status_of({"", 1, 1, "", Relation::at_most, ""}, true), 0);
  EXPECT_EQ(exit_status_of({"", 1.01, 1, "", Relation::at_most, ""}, true), 1);
  EXPECT_EQ(exit_status_of({"", 0.99, 1, "", Relation::at_least, ""}, true), 1);
  EXPECT_EQ(exit_status_of({"", nan, 1, "", Relation::at_most, ""}, true), 1);
  EXPECT_EQ(exit_status_of({"", nan, 1, "", Relation::at_least, ""}, true), 1);
  EXPECT_EQ(exit_status_of({"", 9, 1, "", Relation::shown, ""}, true), 0);
  EXPECT_EQ(exit_status_of({"", 1.01, 1, "", Relation::at_most, ""}, false), 0);
}

TEST(Figures, NamesOccurOnce) {
  for (const auto* list : {&proofs(), &benches()})
    for (const FigureSet& set : *list) {
      EXPECT_EQ(std::count_if(list->begin(), list->end(), [&](const FigureSet& s) { return s.name == set.name; }), 1);
      EXPECT_FALSE(set.summary.empty());
    }
}

}  // namespace
}  // namespace selvedge::cli
