// `mpirun -n N ./selvedge fit`: the same fit.json for every N, also where a rank is killed on the way and the fit is
// started again.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "files/whole_file.h"
#include "tests/needs_package.h"
#include "tests/waving_felt.h"

extern char** environ;

namespace selvedge::fit {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A waving sheet of six frames.
class Mpirun : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("selvedge_mpirun_" + std::to_string(::getpid()));
    record_waving_felt(folder_ / "felt");
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }
  void SetUp() override {
    SELVEDGE_NEEDS(std::system("mpirun --version >/dev/null 2>&1") == 0, "openmpi-bin", "a fit under mpirun");
  }

  // Starts the fit on some ranks (0: without mpirun) into a folder of that name.
  static pid_t start(int ranks, const std::string& name, const std::string& optimiser) {
    std::string line = "exec ";
    if (ranks > 0)
      line += "mpirun --allow-run-as-root --oversubscribe --bind-to none -n " + std::to_string(ranks) + " ";
    line += SELVEDGE_BINARY " fit " + (folder_ / "felt").string() + " --out " + (folder_ / name).string() +
            " --cells 6 --optimiser " + optimiser;
    if (optimiser != "least_squares") line += " --evaluations 80";
    line += " >" + (folder_ / (name + ".out")).string() + " 2>" + (folder_ / (name + ".err")).string();
    const char* arguments[] = {"sh", "-c", line.c_str(), nullptr};
    pid_t child = 0;
    EXPECT_EQ(posix_spawn(&child, "/bin/sh", nullptr, nullptr, const_cast<char**>(arguments), environ), 0);
    return child;
  }

  static int ended(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  static json fitted(int ranks, const std::string& name, const std::string& optimiser) {
    EXPECT_EQ(ended(start(ranks, name, optimiser)), 0) << files::read_whole(folder_ / (name + ".err"));
    json result = files::read_json(folder_ / name / "fit.json");
    result.erase("wall_s");
    return result;
  }

  // The process of a rank that fits into the folder of that name, or 0.
  static pid_t process_of_rank(int rank, const std::string& name) {
    const std::string wanted = "OMPI_COMM_WORLD_RANK=" + std::to_string(rank), out = (folder_ / name).string();
    for (const auto& entry : fs::directory_iterator("/proc")) {
      std::ifstream command(entry.path() / "cmdline"), environment(entry.path() / "environ");
      const std::string arguments{std::istreambuf_iterator<char>(command), {}},
          all{std::istreambuf_iterator<char>(environment), {}};
      const std::string pid = entry.path().filename().string();
      if (arguments.rfind(SELVEDGE_BINARY, 0) == 0 && arguments.find(out + '\0') != std::string::npos &&
          ('\0' + all).find('\0' + wanted + '\0') != std::string::npos)
        return std::atoi(pid.c_str());
    }
    return 0;
  }

  static long lines_of(const fs::path& journal) {
    std::ifstream in(journal);
    return std::count(std::istreambuf_iterator<char>(in), {}, '\n');
  }

  // Kills a rank as soon as the journal has so many lines. The job ends with it.
  static void kill_on_the_way(int rank, const std::string& name, const std::string& optimiser, const char* journal,
                              long lines) {
    const pid_t job = start(3, name, optimiser);
    int status = 0;
    while (lines_of(folder_ / name / journal) < lines) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      ASSERT_EQ(waitpid(job, &status, WNOHANG), 0) << files::read_whole(folder_ / (name + ".err"));
    }
    const pid_t process = process_of_rank(rank, name);
    ASSERT_GT(process, 0);
    ASSERT_EQ(kill(process, SIGKILL), 0);
    EXPECT_NE(ended(job), 0);
    EXPECT_FALSE(fs::exists(folder_ / name / "fit.json"));
    const std::string said = files::read_whole(folder_ / (name + ".err"));
    EXPECT_NE(said.find("rank " + std::to_string(rank)), std::string::npos) << said;
    for (int other = 0; other < 3; ++other) EXPECT_EQ(process_of_rank(other, name), 0);
    EXPECT_GE(lines_of(folder_ / name / journal), lines);
  }

  static fs::path folder_;
};

fs::path Mpirun::folder_;

TEST_F(Mpirun, LeastSquaresDoNotDependOnTheRanks) {
  const json alone = fitted(0, "squares-0", "least_squares");
  EXPECT_EQ(fitted(3, "squares-3", "least_squares"), alone);
  const std::string said = files::read_whole(folder_ / "squares-3.out");
  EXPECT_EQ(said.find("held-out error"), said.rfind("held-out error")) << "more than one rank printed";
}

TEST_F(Mpirun, LeastSquaresGoOnFromTheirJournalAfterARankWasKilled) {
  const json alone = fitted(0, "squares-alone", "least_squares");
  // The first line says whose journal it is; then come the batches of the coarse grid and the iterations.
  kill_on_the_way(1, "squares-killed", "least_squares", "iterations.txt", 4);
  EXPECT_EQ(fitted(3, "squares-killed", "least_squares"), alone);
  kill_on_the_way(0, "squares-first-killed", "least_squares", "iterations.txt", 10);
  EXPECT_EQ(fitted(2, "squares-first-killed", "least_squares"), alone);
}

TEST_F(Mpirun, ASearchGoesOnFromItsJournalAfterARankWasKilled) {
  const json alone = fitted(0, "cma-0", "cma");
  EXPECT_EQ(fitted(2, "cma-2", "cma"), alone);
  kill_on_the_way(2, "cma-killed", "cma", "evaluations.txt", 5);
  EXPECT_LT(lines_of(folder_ / "cma-killed" / "evaluations.txt"), 80);  // while the search went on
  EXPECT_EQ(fitted(3, "cma-killed", "cma"), alone);
}

TEST_F(Mpirun, BadInputIsSaidOnceAndExitsWithTwo) {
  const fs::path errors = folder_ / "bad.err";
  const int status =
      std::system(("mpirun --allow-run-as-root --oversubscribe -n 3 " SELVEDGE_BINARY " fit " +
                   (folder_ / "nothing").string() + " --out " + (folder_ / "bad").string() + " 2>" + errors.string())
                      .c_str());
  EXPECT_EQ(WEXITSTATUS(status), 2);
  const std::string said = files::read_whole(errors);
  EXPECT_NE(said.find("selvedge: "), std::string::npos) << said;
  EXPECT_EQ(said.find("selvedge: "), said.rfind("selvedge: ")) << said;
}

}  // namespace
}  // namespace selvedge::fit
