// A blind bank and a session's fits by Slurm: the same results as without, also where the node dies in the middle.
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "capture/trial/trial_writer.h"
#include "cli/verify/proofs/simulated_trial.h"
#include "diagnose/diagnosis.h"
#include "evaluation/blind.h"
#include "experiments/simulated_trials.h"
#include "files/whole_file.h"
#include "station/job_array.h"
#include "station/journal.h"
#include "tests/slurm/slurm_cluster.h"

extern char** environ;

namespace selvedge {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A sheet of six cells: a quarter of a second of waving, and one at rest.
void record_small(const std::string& name, double bend, const fs::path& folder) {
  experiments::Fabric fabric;
  fabric.name = name;
  fabric.material.bend = bend;
  experiments::TrialProtocol protocol;
  protocol.cells = 6;
  protocol.frames = 6;
  protocol.frame_rate_hz = 20;
  protocol.trials = {{"still", trial::Experiment::static_hang, 0.29, 0, 0, 0},
                     {"waving", trial::Experiment::waving, 0.29, 0.05, 2.0, 0}};
  experiments::record_fabric(fabric, protocol, folder);
}

// Markers of a swatch that our own model simulates: what lacks nothing is diagnosed soonest.
void record_markers(const std::string& name, double bend, const fs::path& folder) {
  SimulatedSwatch swatch;
  swatch.material.bend = bend;
  trial::Campaign campaign;
  campaign.fabric = name;
  campaign.trials = {simulated_trial(swatch, {.half_apart_m = 0.14}, "still", 1),
                     simulated_trial(swatch, {.half_apart_m = 0.14, .amplitude_m = 0.05, .samples = 48}, "waving", 2)};
  trial::write_campaign(campaign, folder);
}

class Slurm : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("selvedge_slurm_" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "cluster");
    cluster_.emplace(folder_ / "cluster");
  }
  static void TearDownTestSuite() {
    cluster_.reset();
    fs::remove_all(folder_);
  }

  static pid_t start(const std::string& arguments, const std::string& log) {
    const std::string line = "exec " SELVEDGE_BINARY " " + arguments + " >" + (folder_ / log).string() + " 2>&1";
    const char* words[] = {"sh", "-c", line.c_str(), nullptr};
    pid_t child = 0;
    EXPECT_EQ(posix_spawn(&child, "/bin/sh", nullptr, nullptr, const_cast<char**>(words), environ), 0);
    return child;
  }

  static int ended(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

  static int run(const std::string& arguments, const std::string& log) { return ended(start(arguments, log)); }
  static std::string said(const std::string& log) { return files::read_whole(folder_ / log); }

  static json diagnosis_in(const fs::path& folder) {
    json found = files::read_json(folder / "diagnosis.json");
    for (const char* key : {"cpu_s", "wall_s"}) found.erase(key);
    return found;
  }

  static fs::path folder_;
  static std::optional<SlurmCluster> cluster_;
};

fs::path Slurm::folder_;
std::optional<SlurmCluster> Slurm::cluster_;

class BlindBank : public Slurm {
 protected:
  static inline const std::vector<std::string> kIds = {"ca", "cb"};

  void SetUp() override {
    for (size_t i = 0; i < kIds.size(); ++i)
      record_markers(kIds[i], 6e-5 * (1.0 + static_cast<double>(i)), folder_ / "bank" / "campaigns" / kIds[i]);
    seal("bank", kIds);
  }

  static void seal(const std::string& bank, const std::vector<std::string>& ids) {
    std::vector<evaluation::SealedKey> keys;
    for (const std::string& id : ids) keys.push_back({id, "salt", {{"cause", "none"}}});
    evaluation::seal_keys(folder_ / bank, keys, evaluation::usual_seal());
  }

  static fs::path answer(const std::string& bank, const std::string& id) { return folder_ / bank / "answers" / id; }

  // A task that has fitted its base model and not answered yet, or none.
  static std::optional<size_t> in_the_middle() {
    for (size_t i = 0; i < kIds.size(); ++i)
      if (fs::exists(answer("bank", kIds[i]) / "base_fit.json") &&
          !fs::exists(answer("bank", kIds[i]) / "diagnosis.json"))
        return i;
    return std::nullopt;
  }
};

TEST_F(BlindBank, IsAnsweredAsWithoutSlurmThoughItsNodeDies) {
  const pid_t command = start("blind answer " + (folder_ / "bank").string() + " --slurm --at-once 1", "bank.log");
  std::optional<size_t> cut_off;
  for (int status = 0; !(cut_off = in_the_middle());) {
    ASSERT_EQ(waitpid(command, &status, WNOHANG), 0) << said("bank.log");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  cluster_->kill_node(command);
  ASSERT_EQ(in_the_middle(), cut_off);
  const std::string id = kIds[*cut_off];
  fs::create_directories(folder_ / "alone" / "campaigns");
  fs::copy(folder_ / "bank" / "campaigns" / id, folder_ / "alone" / "campaigns" / id, fs::copy_options::recursive);
  seal("alone", {id});
  fs::create_directories(answer("alone", id));
  fs::copy(answer("bank", id) / "base_fit.json", answer("alone", id) / "base_fit.json");
  cluster_->start_node();

  const std::string array = said("bank/slurm/blind.job");
  int restarts = 0, status = 0;
  while (waitpid(command, &status, WNOHANG) == 0) {
    SlurmCluster::begin_requeued_now();
    restarts = std::max(restarts, SlurmCluster::restarts(array.substr(0, array.find('\n')), *cut_off));
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
  EXPECT_EQ(status, 0) << said("bank.log");
  EXPECT_EQ(restarts, 1) << "the task that was cut off was not requeued";
  EXPECT_NE(said("bank.log").find("2 of 2 campaigns are answered; the answers are final"), std::string::npos);

  // The task that was cut off went on from its base fit, as it does on this host alone.
  ASSERT_EQ(run("blind answer " + (folder_ / "alone").string(), "alone.log"), 0) << said("alone.log");
  EXPECT_EQ(diagnosis_in(answer("bank", id)), diagnosis_in(answer("alone", id))) << id;
  EXPECT_FALSE(evaluation::read_record(folder_ / "bank").answers.empty());
}

TEST_F(Slurm, RefusalsAreOneErrorAndExitWithTwo) {
  const fs::path bank = folder_ / "refused";
  evaluation::seal_keys(bank, {{"ca", "salt", {{"cause", "none"}}}}, evaluation::usual_seal());
  EXPECT_EQ(run("blind answer " + bank.string() + " --slurm --sbatch=--partition=nowhere", "partition.log"), 2);
  EXPECT_NE(said("partition.log").find("selvedge: sbatch: found \""), std::string::npos) << said("partition.log");
  EXPECT_NE(said("partition.log").find("partition"), std::string::npos) << said("partition.log");

  const std::string path = std::getenv("PATH");
  fs::create_directories(folder_ / "no-commands");
  setenv("PATH", (folder_ / "no-commands").c_str(), 1);
  EXPECT_EQ(run("blind answer " + bank.string() + " --slurm", "missing.log"), 2);
  setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(said("missing.log"),
            "selvedge: sbatch: found no such program, expected Slurm's commands (Debian: slurm-client) in PATH\n");
}

TEST_F(Slurm, ATaskThatFailsIsNamedWithItsLastWords) {
  const fs::path bank = folder_ / "empty";
  evaluation::seal_keys(bank, {{"ca", "salt", {{"cause", "none"}}}}, evaluation::usual_seal());  // and no campaign
  EXPECT_EQ(run("blind answer " + bank.string() + " --slurm", "empty.log"), 1);
  EXPECT_NE(said("empty.log")
                .find("ca: its task ended without an answer; its log " + (bank / "slurm" / "blind-0.log").string() +
                      " ends with: selvedge: "),
            std::string::npos)
      << said("empty.log");
}

// A session whose recording is over: what is left to do goes to Slurm, and its journal has it.
class RecordedSession : public Slurm {
 protected:
  static inline const std::vector<std::string> kFabrics = {"felt", "knit"};

  void SetUp() override {
    std::string text = fmt::format(
        "[session]\nrig = \"{}/examples/demo-rig.toml\"\nfabrics = [\"felt\", \"knit\"]\ntrials = [\"still\", "
        "\"waving\"]\n[session.still]\nkind = \"static\"\nduration_s = 3.0\n[session.waving]\nkind = "
        "\"waving\"\nduration_s = 3.0\n[fit]\ncells = 6\n[diagnosis]\neffects = [\"camera_delay\", "
        "\"local_mass\"]\ncells = 6\n",
        SELVEDGE_SOURCE_DIR);
    for (const std::string& fabric : kFabrics)
      text += fmt::format("[fabric.{}]\nwidth_m = 0.3\nheight_m = 0.3\nmass_kg = 0.0153\n", fabric);
    files::write_whole(folder_ / "session.toml", text);
    for (const char* name : {"by-slurm", "by-itself"}) record(folder_ / name, text);
  }

  static void record(const fs::path& folder, const std::string& text) {
    station::Journal journal(folder, text);
    journal.begun("calibrate");
    journal.done("calibrate", 1, {});
    for (size_t i = 0; i < kFabrics.size(); ++i) {
      record_small(kFabrics[i], 2e-5 * (1.0 + static_cast<double>(i)), folder / kFabrics[i]);
      for (const char* trial : {"still", "waving"}) {
        journal.begun(kFabrics[i] + "/record/" + trial);
        journal.done(kFabrics[i] + "/record/" + trial, 1, {{"frames", 10}});
      }
    }
  }

  static json fit_in(const fs::path& folder) {
    json fit = files::read_json(folder / "fit.json");
    fit.erase("wall_s");
    return fit;
  }
};

// Whether a session's diagnosis began with the fabric's fit: its base fit is kept as one that did.
bool began_with_fit(const fs::path& fabric) {
  const trial::Campaign campaign = trial::read_campaign(fabric);
  diagnose::DiagnosisOptions options;
  options.study.protocol.cells = 6;
  if (!diagnose::begin_with_fit(options, campaign, {fabric})) return false;
  diagnose::keep_base_fit(options, fabric / "diagnosis" / "base_fit.json", campaign);
  return options.study.base_fit.has_value();
}

TEST_F(RecordedSession, HasItsFitsDoneByOneArrayAndItsDiagnosesByOneThatFollows) {
  const std::string file = "session run " + (folder_ / "session.toml").string() + " --out ";
  ASSERT_EQ(run(file + (folder_ / "by-itself").string(), "by-itself.log"), 0) << said("by-itself.log");
  ASSERT_EQ(run(file + (folder_ / "by-slurm").string() + " --slurm", "by-slurm.log"), 0) << said("by-slurm.log");
  for (const char* array : {"fit", "diagnose"})
    EXPECT_NE(said(fmt::format("by-slurm/slurm/session-{}.sh", array)).find("#SBATCH --array=0-1\n"),
              std::string::npos);
  const std::string fits = said("by-slurm/slurm/session-fit.job");
  EXPECT_NE(said("by-slurm/slurm/session-diagnose.sh").find("#SBATCH --dependency=aftercorr:" + fits),
            std::string::npos);
  const auto here = station::read_journal(folder_ / "by-itself"), there = station::read_journal(folder_ / "by-slurm");
  for (const std::string& fabric : kFabrics) {
    EXPECT_EQ(fit_in(folder_ / "by-slurm" / fabric), fit_in(folder_ / "by-itself" / fabric)) << fabric;
    EXPECT_EQ(diagnosis_in(folder_ / "by-slurm" / fabric / "diagnosis"),
              diagnosis_in(folder_ / "by-itself" / fabric / "diagnosis"))
        << fabric;
    for (const char* how : {"by-slurm", "by-itself"}) EXPECT_TRUE(began_with_fit(folder_ / how / fabric)) << how;
    for (const char* step : {"/fit", "/diagnose"}) {
      EXPECT_EQ(there.at(fabric + step).state, station::StepRecord::State::done);
      EXPECT_EQ(there.at(fabric + step).result, here.at(fabric + step).result);
    }
  }
}

TEST_F(Slurm, ATaskAfterAnotherArrayWaitsForItsOwnAndIsCancelledWhereThatFails) {
  const fs::path folder = folder_ / "after";
  const auto shell = [&](size_t index, const std::string& line, const std::string& after) {
    return station::ArrayTask{index, {"/bin/sh", "-c", "cd '" + folder.string() + "' && " + line}, after};
  };
  const station::SlurmOptions options;
  const station::JobArray first(folder, "first", {shell(0, "sleep 2; exit 1", ""), shell(1, "sleep 4; touch done", "")},
                                options);
  const station::JobArray second(
      folder, "second",
      {shell(0, "touch after-failure", first.number_of(0)), shell(1, "mv done after-done", first.number_of(1))},
      options);
  const auto there = [&] { return fs::exists(folder / "after-done") ? size_t{1} : size_t{0}; };
  const auto silent = [](double, const std::string&) {};
  EXPECT_EQ(second.wait({1}, 1, there, silent), 1u) << second.last_words(1);
  EXPECT_EQ(second.wait(
                {0}, 1, [] { return size_t{0}; }, silent),
            0u);  // until Slurm cancelled it
  EXPECT_FALSE(fs::exists(folder / "after-failure"));
}

TEST(JobArray, NamesItsTasksInRanges) {
  EXPECT_EQ(station::index_ranges({0, 1, 2, 5, 7, 8}), "0-2,5,7-8");
  EXPECT_EQ(station::index_ranges({4}), "4");
}

TEST(JobArray, QuotesWhatAShellWouldTakeApart) {
  const std::string odd = "a b'c$d\"e";
  EXPECT_EQ(output_of_shell("printf %s " + station::shell_word(odd)), odd);
}

}  // namespace
}  // namespace selvedge
