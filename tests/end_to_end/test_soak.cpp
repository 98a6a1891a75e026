// `./selvedge soak` for a minute and some: every kind of fault once, nothing lost, nothing moves that may not.
#include <cstdlib>
#include <filesystem>
#include <numeric>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "files/whole_file.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

TEST(Soak, LosesNothingAndMovesNothingThatMayNot) {
  const fs::path runs = fs::temp_directory_path() / fmt::format("selvedge-soak-{}", ::getpid());
  fs::remove_all(runs);
  fs::create_directories(runs);
  const int status = std::system(fmt::format("'{}' soak --hours 0.02 --seed 1 --runs '{}' > '{}' 2>&1", SELVEDGE_BINARY,
                                             runs.string(), (runs / "output").string())
                                     .c_str());
  const std::string output = files::read_whole(runs / "output");
  EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 0) << output;
  ASSERT_TRUE(fs::exists(runs / "soak-1" / "soak.json")) << output;
  const auto json = files::read_json(runs / "soak-1" / "soak.json");
  EXPECT_EQ(json.at("frames").at("lost"), 0) << output;
  EXPECT_EQ(json.at("arm").at("motions_after_stop"), 0) << output;
  EXPECT_GT(json.at("frames").at("written"), 0) << output;
  EXPECT_GT(json.at("arm").at("stops"), 0) << output;
  int kinds = 0;
  for (const auto& [kind, count] : json.at("faults").items()) kinds += count > 0;
  EXPECT_GE(kinds, 5) << output;
  if (!testing::Test::HasFailure()) fs::remove_all(runs);
}

}  // namespace
}  // namespace selvedge
