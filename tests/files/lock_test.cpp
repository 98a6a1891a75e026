#include <filesystem>
#include <optional>

#include <gtest/gtest.h>
#include <unistd.h>

#include "files/lock.h"
#include "files/whole_file.h"

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

// As a file server leaves it that has not noticed that a host died.
TEST(Lock, OfATaskThatIsDeadDoesNotBlockItsNextRun) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("selvedge_task_lock_" + std::to_string(::getpid()));
  {
    const Lock dead(path, "task 4_0", true);
    ASSERT_TRUE(dead.held());
    EXPECT_EQ(read_whole(path), "task 4_0");
    EXPECT_FALSE(Lock(path, "task 4_1", true).held());
    EXPECT_FALSE(Lock(path, "task 4_0", false).held());
    EXPECT_FALSE(Lock(path).held());
    const Lock next_run(path, "task 4_0", true);
    EXPECT_TRUE(next_run.held());
    EXPECT_FALSE(Lock(path, "task 4_1", true).held());
  }
  EXPECT_TRUE(Lock(path, "a process", false).held());
  EXPECT_EQ(read_whole(path), "a process");
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace selvedge::files
