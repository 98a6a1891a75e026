#include <filesystem>
#include <optional>

#include <gtest/gtest.h>
#include <unistd.h>

#include "files/lock.h"

namespace selvedge::files {
namespace {

TEST(Lock, IsHeldOnceAndLetGoOf) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("selvedge_lock_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  for (const std::filesystem::path& path : {folder, folder / "a.lock"}) {
    std::optional<Lock> first(path);
    EXPECT_TRUE(first->held()) << path;
    EXPECT_FALSE(Lock(path).held()) << path;
    first.reset();
    EXPECT_TRUE(Lock(path).held()) << path;
  }
  EXPECT_FALSE(Lock(folder / "missing" / "a.lock").held());
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace selvedge::files
