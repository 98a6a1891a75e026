#include <gtest/gtest.h>

#include <fstream>

#include "files/bad_input.h"
#include "rig/projector/flash_table.h"

namespace selvedge::projector {
namespace {

TEST(FlashTable, ShippedFileSaysWhatIsBuiltIn) {
  const FlashTable file = read_flash_table(SELVEDGE_SOURCE_DIR "/data/projector/flash.toml");
  const FlashTable built_in = standard_flash_table();
  ASSERT_EQ(file.planes.size(), built_in.planes.size());
  for (size_t i = 0; i < file.planes.size(); ++i) {
    EXPECT_EQ(file.planes[i].image, built_in.planes[i].image);
    EXPECT_EQ(file.planes[i].plane, built_in.planes[i].plane);
    EXPECT_EQ(file.planes[i].pattern, built_in.planes[i].pattern);
  }
}

TEST(FlashTable, FindsAPictureAndItsInverse) {
  const FlashTable table = standard_flash_table();
  Pattern wanted{.kind = PatternKind::stripes, .period_px = 16};
  wanted.bit = 9;  // means nothing for stripes
  ASSERT_NE(table.find(wanted), nullptr);
  EXPECT_EQ(table.find(wanted)->image, 2);
  EXPECT_EQ(table.find(wanted)->plane, 6);
  wanted.inverted = true;
  EXPECT_NE(table.find(wanted), nullptr);
  wanted.period_px = 17;
  EXPECT_EQ(table.find(wanted), nullptr);
}

TEST(FlashTable, MistakesAreRefusedByName) {
  const auto path = std::filesystem::temp_directory_path() / "selvedge-flash-table.toml";
  const std::string run = "[[planes]]\nimage = 0\nfirst_plane = 20\nkind = \"gray_code\"\norientation = \"vertical\"\n";
  const std::pair<std::string, std::string> cases[] = {{run + "bits = [0, 1, 2, 3, 4]\n", "24 planes"},
                                                       {run + "bits = [0]\n" + run + "bits = [1]\n", "listed twice"},
                                                       {run + "bits = []\n", "bits"},
                                                       {run + "bits = [0]\nduty = 0.5\n", "duty"},
                                                       {"[[planes]]\nimage = 900\n", "image"},
                                                       {"planes = 3\nstripes = 4\n", "stripes"},
                                                       {"[lines]\nduty = 0.5\n", "period_px"},
                                                       {"[lines\n", "1"}};
  for (const auto& [text, word] : cases) {
    std::ofstream(path) << text;
    try {
      read_flash_table(path);
      ADD_FAILURE() << "accepted: " << text;
    } catch (const BadInput& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  }
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace selvedge::projector
