// The live picture: silhouette and stripe quality of a painted frame.
#include "console/preview.h"

#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace selvedge::console {
namespace {

// Fabric in the middle, striped with the given grey levels; the right half of it fainter.
std::vector<uint8_t> painted(int width, int height) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 1);
  std::vector<uint8_t> pixels(static_cast<size_t>(width * height));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const bool fabric = x >= 160 && x < 480 && y >= 80 && y < 400;
      const bool bright = (y / 4) % 2 == 0;
      const double grey = !fabric ? 5 : x < 320 ? (bright ? 180 : 40) : (bright ? 66 : 56);
      pixels[static_cast<size_t>(y * width + x)] = static_cast<uint8_t>(std::clamp(grey + noise(random), 0.0, 255.0));
    }
  return pixels;
}

TEST(LivePicture, OutlinesTheFabricAndTellsPlainStripesFromFaintOnes) {
  const LivePicture picture = live_picture(painted(640, 480), 640, 480, true);
  EXPECT_NEAR(picture.inside_share, 320.0 * 320 / (640 * 480), 0.01);
  ASSERT_EQ(picture.outline.size(), 1u);
  ASSERT_GT(picture.tiles.size(), 300u);
  for (const StripeTile& tile : picture.tiles) {
    if (tile.x + kTile_px <= 320) { EXPECT_GT(tile.contrast, 100) << tile.x << " " << tile.y; }
    if (tile.x >= 320) { EXPECT_LT(tile.contrast, 20) << tile.x << " " << tile.y; }
  }
  EXPECT_EQ(picture.png.substr(1, 3), "PNG");
  const auto overlay = nlohmann::json::parse(overlay_json(picture));
  EXPECT_EQ(overlay["tiles"].size(), picture.tiles.size());
}

TEST(LivePicture, AnEmptySceneHasNoFabric) {
  const LivePicture picture = live_picture(std::vector<uint8_t>(640 * 480, 5), 640, 480, true);
  EXPECT_TRUE(picture.tiles.empty());
}

}  // namespace
}  // namespace selvedge::console
