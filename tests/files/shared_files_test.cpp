#include "files/shared_files.h"

#include <gtest/gtest.h>

namespace selvedge::files {
namespace {

namespace fs = std::filesystem;

TEST(SharedFiles, ComeWithTheSourceFolderWhereNothingIsInstalled) {
  EXPECT_FALSE(installed_folder());
  EXPECT_EQ(shared_folder(), fs::path(SELVEDGE_SOURCE_DIR));
}

TEST(SharedFiles, ARelativePathLeadsThereWhereTheWorkingFolderHasNone) {
  const fs::path before = fs::current_path(), folder = fs::path(testing::TempDir()) / "selvedge_shared_files";
  fs::remove_all(folder);
  fs::create_directories(folder / "data" / "arms");
  fs::current_path(folder);
  EXPECT_EQ(or_shared("data/arms/ur5e.toml"), shared_folder() / "data/arms/ur5e.toml");
  EXPECT_EQ(or_shared("data/arms/nobody.toml"), fs::path("data/arms/nobody.toml"));
  EXPECT_EQ(or_shared("/data/arms/ur5e.toml"), fs::path("/data/arms/ur5e.toml"));
  fs::copy_file(shared_folder() / "data/arms/pa10.toml", folder / "data/arms/ur5e.toml");
  EXPECT_EQ(or_shared("data/arms/ur5e.toml"), fs::path("data/arms/ur5e.toml"));
  fs::current_path(before);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace selvedge::files
