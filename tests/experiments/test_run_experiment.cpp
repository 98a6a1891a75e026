// Short experiments from file to figures, and one that is killed on the way.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>

#include "experiments/experiment_report.h"
#include "files/bad_input.h"
#include "tests/experiments/small_experiment.h"

extern char** environ;

namespace selvedge::experiments {
namespace {

using nlohmann::json;

const report::ProgressCallback kSilent = [](double, const std::string&) {};

ExperimentOutcome run_quick(const std::string& name, const std::filesystem::path& folder) {
  const ExperimentOutcome out = run_experiment(read_experiment(kExamples / name), true, folder, kSilent);
  write_experiment(out, folder);
  return out;
}

TEST(RunExperiment, StaticTrialsLeaveDampingUndetermined) {
  const ScratchFolder folder("static");
  const ExperimentOutcome out = run_quick("static.toml", folder.path());
  ASSERT_EQ(out.fabrics.size(), 2u);
  for (const FabricOutcome& f : out.fabrics) {
    const Identification& found = f.identified.front();
    for (Eigen::Index t = 0; t < 2; ++t) EXPECT_LE(found.error(t + 1, t), found.error(0, t));
    for (size_t k = 3; k < 6; ++k) EXPECT_GT(found.variability[k], 100);
  }
  const std::vector<ResultTable> tables = tables_of(out);
  ASSERT_EQ(tables.size(), 3u);  // two fabrics, and the repeats
  EXPECT_EQ(tables[0].header.back(), "paper exp 2");
  EXPECT_EQ(tables[0].rows.front().size(), tables[0].header.size());
  const json result = files::read_json(folder.path() / "result.json");
  EXPECT_EQ(result["fabrics"]["linen"]["optimisers"]["annealing"]["sets"].size(), 2u);
  EXPECT_GT(std::filesystem::file_size(folder.path() / "report.html"), 5000u);
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

FabricOutcome run_small(const std::string& text) {
  const ScratchFolder folder("small");
  ExperimentOutcome out =
      run_experiment(read_experiment(folder.write("e.toml", text)), false, folder.path() / "out", kSilent);
  write_experiment(out, folder.path() / "out");
  for (const ResultTable& table : tables_of(out))
    for (const auto& row : table.rows) EXPECT_EQ(row.size(), table.header.size()) << table.title;
  return std::move(out.fabrics.front());
}

TEST(RunExperiment, WavingTrialsByTwoOptimisers) {
  const FabricOutcome f =
      run_small(with(small_experiment("waving"), "[\"annealing\"]", "[\"annealing\", \"least_squares\"]"));
  ASSERT_EQ(f.identified.size(), 2u);
  EXPECT_EQ(f.identified[1].labels, (std::vector<std::string>{"together"}));
  for (const Identification& found : f.identified) EXPECT_LT(found.chosen_error(), found.error.row(0).sum());
}

TEST(RunExperiment, ResidualsServeWhereFoldsDoNot) {
  const FabricOutcome f = run_small(with(small_experiment("waving"), "[fit]\n", "[fit]\nerror = \"residuals\"\n"));
  EXPECT_LT(f.identified.front().chosen_error(), f.identified.front().error.row(0).sum());
}

TEST(RunExperiment, GeneralisationJudgesLaterFrames) {
  const FabricOutcome f = run_small(
      with(with(small_experiment("waving"), "\"waving\"", "\"generalisation\""), "frames = 6\n", "frames = 10\n"));
  ASSERT_EQ(f.predicted, (std::vector<size_t>{0}));
  EXPECT_EQ(f.fabric->fitted.tracks[0].time_s.size(), 6u);
  EXPECT_EQ(f.fabric->later.tracks[0].time_s.size(), 4u);
  EXPECT_LT(f.prediction(2, 0), f.prediction(0, 0));  // truth and start
}

TEST(RunExperiment, RobotTrialsArePredicted) {
  std::string text = with(with(small_experiment("waving"), "\"waving\"", "\"robot\""), "[\"a\"]", "[\"a\", \"b\"]");
  const FabricOutcome f = run_small(
      text + "[trials.b]\nkind = \"robot\"\napart_m = 0.29\namplitude_m = 0.03\nfrequency_hz = 0.9\nframes = 8\n");
  EXPECT_EQ(f.fitted, (std::vector<size_t>{0}));
  EXPECT_EQ(f.predicted, (std::vector<size_t>{1}));
  EXPECT_EQ(f.fabric->fitted.tracks[1].time_s.size(), 8u);
  EXPECT_LT(f.prediction(2, 0), f.prediction(0, 0));
}

TEST(RunExperiment, RecordedTrialsTakeTheFabricsPlace) {
  const ScratchFolder folder("recorded");
  const std::filesystem::path path = folder.write("e.toml", small_experiment());
  run_experiment(read_experiment(path), false, folder.path() / "first", kSilent);
  ExperimentFile file = read_experiment(path);
  use_campaigns(file, {folder.path() / "first" / "trials" / "felt"});
  ASSERT_TRUE(file.fabrics.front().recorded());
  const ExperimentOutcome out = run_experiment(file, false, folder.path() / "second", kSilent);
  EXPECT_EQ(out.fabrics.front().fabric->fabric.name, "felt");
  EXPECT_FALSE(out.fabrics.front().fabric->truth);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "second" / "trials"));
  // Waving experiments have no use for a static trial.
  file.kind = Kind::waving;
  EXPECT_THROW(run_experiment(file, false, folder.path() / "third", kSilent), BadInput);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "third"));
}

TEST(RunExperiment, AFolderOfOtherInputsIsRefused) {
  const ScratchFolder folder("other");
  std::string text = small_experiment();
  run_experiment(read_experiment(folder.write("e.toml", text)), false, folder.path() / "out", kSilent);
  text.replace(text.find("evaluations = 20"), 16, "evaluations = 21");
  EXPECT_THROW(run_experiment(read_experiment(folder.write("e.toml", text)), false, folder.path() / "out", kSilent),
               BadInput);
}

TEST(RunExperiment, SkirtIsWornInEachFabric) {
  const ScratchFolder folder("skirt");
  const ExperimentOutcome out = run_quick("skirt.toml", folder.path());
  ASSERT_EQ(out.skirts.size(), 2u);
  for (const SkirtOutcome& s : out.skirts) {
    EXPECT_TRUE(s.finite);
    EXPECT_EQ(s.frames_that_intersect, 0);
    EXPECT_EQ(s.pictures.size(), 4u);
  }
  // What is there is not simulated again.
  const ExperimentOutcome again = run_quick("skirt.toml", folder.path());
  EXPECT_EQ(again.skirts[0].wall_s, out.skirts[0].wall_s);
  EXPECT_EQ(again.skirts[1].pictures, out.skirts[1].pictures);
}

// Times depend on the run, and on what an earlier one left.
json without_times(json value) {
  if (value.is_object()) {
    for (const char* key : {"wall_s", "evaluations_from_journal"}) value.erase(key);
    for (auto& [key, inner] : value.items()) inner = without_times(inner);
  }
  return value;
}

TEST(RunExperiment, AKilledOneContinuesToTheSameResult) {
  const ScratchFolder folder("killed");
  const std::filesystem::path path = folder.write("e.toml", small_experiment("waving")),
                              journal = folder.path() / "killed" / "fits" / "felt-annealing-a.evaluations.txt";
  const std::string file = path.string(), out = (folder.path() / "killed").string();
  const char* arguments[] = {SELVEDGE_BINARY, "experiment", file.c_str(), "--out", out.c_str(), nullptr};
  pid_t child = 0;
  ASSERT_EQ(posix_spawn(&child, SELVEDGE_BINARY, nullptr, nullptr, const_cast<char**>(arguments), environ), 0);
  const auto lines = [&] {
    std::ifstream in(journal);
    return std::count(std::istreambuf_iterator<char>(in), {}, '\n');
  };
  int status = 0;
  bool ended = false;
  while (lines() < 4 && !ended) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ended = waitpid(child, &status, WNOHANG) != 0;
  }
  if (!ended) {
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
  }
  const auto known = lines() - 1;
  ASSERT_GT(known, 0);

  for (const char* name : {"killed", "whole"})
    write_experiment(run_experiment(read_experiment(path), false, folder.path() / name, kSilent), folder.path() / name);
  const json killed = files::read_json(folder.path() / "killed" / "result.json"),
             whole = files::read_json(folder.path() / "whole" / "result.json");
  EXPECT_EQ(without_times(killed), without_times(whole));
  const json& set = killed["fabrics"]["felt"]["optimisers"]["annealing"]["sets"]["exp 1"];
  EXPECT_TRUE(!WIFSIGNALED(status) || set["evaluations_from_journal"].get<long>() >= known);
}

TEST(ExperimentCommand, BadInputIsOneLineAndExitTwo) {
  const ScratchFolder folder("command");
  folder.write("e.toml", "[experiment]\nkind = \"static\"\nfabrics = [\"x\"]\n");
  const std::string err = (folder.path() / "err").string(), out = (folder.path() / "out").string();
  const int status = std::system((std::string(SELVEDGE_BINARY) + " experiment " + (folder.path() / "e.toml").string() +
                                  " --out " + out + " 2>" + err)
                                     .c_str());
  EXPECT_EQ(WEXITSTATUS(status), 2);
  const std::string text = files::read_whole(err);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
  EXPECT_NE(text.find("fabrics"), std::string::npos) << text;
  EXPECT_FALSE(std::filesystem::exists(out));
}

}  // namespace
}  // namespace selvedge::experiments
