// What ranks promise, on a small program of known costs under mpirun.
#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "files/whole_file.h"
#include "model/ranks/ranks.h"

namespace selvedge::model {
namespace {

namespace fs = std::filesystem;

struct Said {
  int exit_status = 0;
  std::string out, errors;
  int computed_by_first() const { return std::atoi(errors.substr(errors.find("first:") + 6).c_str()); }
};

Said on_ranks(int ranks, const std::string& mode) {
  const fs::path at = fs::temp_directory_path() / ("selvedge_on_ranks_" + std::to_string(::getpid()));
  std::string line =
      ranks == 0 ? std::string()
                 : "mpirun --allow-run-as-root --oversubscribe --bind-to none -n " + std::to_string(ranks) + " ";
  line += ON_RANKS " " + mode + " >" + at.string() + ".out 2>" + at.string() + ".err";
  Said said;
  const int status = std::system(line.c_str());
  said.exit_status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  said.out = files::read_whole(at.string() + ".out");
  said.errors = files::read_whole(at.string() + ".err");
  fs::remove(at.string() + ".out");
  fs::remove(at.string() + ".err");
  return said;
}

TEST(Ranks, TheirNumberDoesNotChangeTheBits) {
  const Said alone = on_ranks(0, "search");
  ASSERT_EQ(alone.exit_status, 0) << alone.errors;
  for (const int count : {1, 2, 3, 5}) {
    const Said spread = on_ranks(count, "search");
    EXPECT_EQ(spread.exit_status, 0) << spread.errors;
    EXPECT_EQ(spread.out, alone.out) << count;
    EXPECT_EQ(spread.computed_by_first() < alone.computed_by_first(), count > 1) << spread.errors;
  }
}

TEST(Ranks, ASlowOneGetsLess) {
  const Said alone = on_ranks(0, "uneven"), spread = on_ranks(3, "uneven");
  EXPECT_EQ(spread.exit_status, 0) << spread.errors;
  EXPECT_EQ(spread.out, alone.out);
  // Of twelve shares the slow rank takes the one that it began with, and another has the other ten beside the first's.
  EXPECT_GT(spread.computed_by_first(), 0) << spread.errors;
  EXPECT_LT(spread.computed_by_first(), 4000) << spread.errors;
}

TEST(Ranks, WhatIsRememberedIsNotAskedAgain) {
  const Said spread = on_ranks(2, "remembered");
  EXPECT_EQ(spread.exit_status, 0) << spread.errors;
  EXPECT_EQ(spread.out, on_ranks(0, "remembered").out);
  EXPECT_EQ(spread.computed_by_first(), 0);
}

TEST(Ranks, OneThatGivesUpEndsTheJobWithItsWords) {
  const Said failed = on_ranks(3, "failing");
  EXPECT_EQ(failed.exit_status, 3) << failed.errors;
  EXPECT_EQ(failed.out, "");
  EXPECT_NE(failed.errors.find("error: ranks: rank 1 gave up: this fabric has torn\n"), std::string::npos)
      << failed.errors;
}

TEST(Ranks, NoLauncherNoRanks) { EXPECT_EQ(Ranks::join(), nullptr); }

}  // namespace
}  // namespace selvedge::model
