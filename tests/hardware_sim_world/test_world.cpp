#include "hardware_sim/world/world.h"

#include <cmath>

#include <gtest/gtest.h>

#include "files/bad_input.h"
#include "rig/clock.h"

namespace selvedge::hardware_sim {
namespace {

WorldConfiguration default_world() { return read_world(rig::Configuration::parse("", "test", world_sections())); }

projector::Pattern stripes() {
  return {.kind = projector::PatternKind::stripes, .orientation = projector::Orientation::horizontal, .period_px = 32};
}

struct Picture {
  std::vector<unsigned char> pixels;
  int width;
  int at(int x, int y) const { return pixels[size_t(y) * width + x]; }
};

Picture picture(World& world, double t) {
  const auto& camera = world.configuration().camera;
  Picture p{std::vector<unsigned char>(size_t(camera.width_px) * camera.height_px), camera.width_px};
  EXPECT_TRUE(world.image_at(t, p.pixels.data()));
  return p;
}

TEST(WorldConfiguration, RefusesUnknownKeysAndValuesOutOfRange) {
  const auto read = [](const std::string& text) {
    return read_world(rig::Configuration::parse(text, "w.toml", world_sections()));
  };
  EXPECT_THROW(read("[fabric]\nbendy = 1\n"), BadInput);
  EXPECT_THROW(read("[fabric]\nstretch = -1\n"), BadInput);
  EXPECT_THROW(read("[febric]\nstretch = 1\n"), BadInput);
  EXPECT_EQ(read("[fabric]\nstretch = 70\n").fabric.stretch, 70);
}

TEST(World, ChangesTheSwatchWhenAsked) {
  const std::string text =
      "[lattice]\ncells_across = 10\ncells_down = 10\n[swatches]\nnames = [\"soft\", \"wide\"]\n[swatches.soft]\nbend "
      "= 2e-5\n[swatches.wide]\nwidth_m = 0.36\nheight_m = 0.24\n";
  World world(read_world(rig::Configuration::parse(text, "test", world_sections())), 100, Clockwork::by_hand);
  EXPECT_EQ(world.configuration().fabric.bend, 2e-5);
  world.on_prompt({.step = "hang_still"}, 100);
  world.advance_to(103);
  ASSERT_EQ(world.markers_at(102.9).size(), 2u);
  const double apart = (world.markers_at(102.9)[1].position_m - world.markers_at(102.9)[0].position_m).norm();
  world.on_prompt({.step = "change_swatch", .index = 1}, 103);
  world.advance_to(105);
  EXPECT_TRUE(world.markers_at(104.9).empty());  // taken down
  world.on_prompt({.step = "hang_still"}, 105);
  world.advance_to(108);
  const auto markers = world.markers_at(107.9);
  ASSERT_EQ(markers.size(), 2u);
  EXPECT_NEAR((markers[1].position_m - markers[0].position_m).norm(), apart * 0.36 / 0.3, 1e-3);
  EXPECT_NEAR(world.fabric_at(107.9).row(2).minCoeff(), -0.24, 0.03);
  EXPECT_THROW(read_world(rig::Configuration::parse("[swatches]\nnames = [\"soft\"]\n", "test", world_sections())),
               BadInput);
}

TEST(World, HangsAtRestBetweenItsCornersAndSwingsWhenWaved) {
  World world(default_world(), 100, Clockwork::by_hand);
  world.set_pattern_source([](double) { return stripes(); });
  world.on_prompt({.step = "hang_still"}, 100);
  world.advance_to(103);
  auto markers = world.markers_at(102.9);
  ASSERT_EQ(markers.size(), 2u);
  EXPECT_EQ(markers[0].name, "left");
  EXPECT_NEAR((markers[1].position_m - markers[0].position_m).norm(), world.configuration().separation_m, 1e-4);
  const Eigen::Matrix3Xd early = world.fabric_at(101.5), late = world.fabric_at(102.9);
  EXPECT_LT((early - late).colwise().norm().maxCoeff(), 2e-4);
  // It hangs below its corners, as far as it is high.
  EXPECT_NEAR(late.row(2).minCoeff(), -world.configuration().fabric.height_m, 0.02);

  world.on_prompt({.step = "wave_right_corner", .amplitude_m = 0.05, .frequency_hz = 1.2, .duration_s = 3}, 103);
  world.advance_to(105.9);
  double low = 1, high = -1, longest = 0;
  for (double t = 103.3; t < 105.9; t += 0.01) {
    markers = world.markers_at(t);
    low = std::min(low, markers[1].position_m.y());
    high = std::max(high, markers[1].position_m.y());
    longest = std::max(longest, (markers[1].position_m - markers[0].position_m).norm());
  }
  EXPECT_NEAR(high - low, 0.1, 0.015);
  EXPECT_LT(longest, world.configuration().fabric.width_m);
  // The fabric follows: its lower corner moves, and no edge of the sheet is longer than fabric can be.
  EXPECT_GT((world.fabric_at(104.5) - world.fabric_at(104.1)).colwise().norm().maxCoeff(), 0.02);
}

TEST(World, CameraSeesStripesOnTheFabricWhereTheProjectorPutsThem) {
  World world(default_world(), 100, Clockwork::by_hand);
  world.set_pattern_source([](double) { return stripes(); });
  world.on_prompt({.step = "hang_still"}, 100);
  world.advance_to(102.5);
  const Picture p = picture(world, 102.4);
  const Eigen::Matrix3Xd nodes = world.fabric_at(102.4);
  const auto& c = world.configuration();
  const int columns = world.sheet().columns();
  int bright = 0, dark = 0, wrong = 0;
  for (int r = 1; r + 1 < world.sheet().rows(); ++r)
    for (int k = 1; k + 1 < columns; ++k) {
      const Eigen::Vector3d point = nodes.col(r * columns + k);
      const double row = geometry::project(c.projector, point).y();
      const double phase = std::fmod(row + 0.5, 32);
      const Eigen::Vector2d pixel = geometry::project(c.camera, point);
      const int grey = p.at(int(std::lround(pixel.x())), int(std::lround(pixel.y())));
      if (phase > 5 && phase < 11) ++bright, wrong += grey < 120;
      if (phase > 21 && phase < 27) ++dark, wrong += grey > 40 || grey < 8;
    }
  EXPECT_GT(bright, 25);
  EXPECT_GT(dark, 25);
  EXPECT_EQ(wrong, 0);
  EXPECT_NEAR(p.at(5, 5), 4, 6);
}

TEST(World, ShowsTheBoardWithItsDiscsBrightWhileTheLampIsOff) {
  World world(default_world(), 100, Clockwork::by_hand);
  for (int pose = 0; pose < 3; ++pose) {
    const double asked = 100 + 3 * pose;
    world.on_prompt({.step = "show_grid_pose", .index = pose}, asked);
    world.advance_to(asked + 3);
    EXPECT_TRUE(world.markers_at(asked + 0.5 + 0.3 * (pose == 0)).empty());
    const auto markers = world.markers_at(asked + 2.5);
    const auto& c = world.configuration();
    ASSERT_EQ(int(markers.size()), c.grid.count());
    const Picture p = picture(world, asked + 2.5);
    for (const SeenMarker& marker : markers) {
      const Eigen::Vector2d pixel = geometry::project(c.camera, marker.position_m);
      ASSERT_GT(pixel.x(), 8);
      ASSERT_GT(pixel.y(), 8);
      ASSERT_LT(pixel.x(), c.camera.width_px - 9);
      ASSERT_LT(pixel.y(), c.camera.height_px - 9);
      EXPECT_GT(p.at(int(std::lround(pixel.x())), int(std::lround(pixel.y()))), 120) << marker.name;
      const Eigen::Vector2d lit = geometry::project(c.projector, marker.position_m);
      EXPECT_GT(lit.x(), 5) << marker.name;
      EXPECT_GT(lit.y(), 5) << marker.name;
      EXPECT_LT(lit.x(), c.projector.width_px - 5) << marker.name;
      EXPECT_LT(lit.y(), c.projector.height_px - 5) << marker.name;
    }
  }
}

TEST(World, TheArmCarriesTheRightCorner) {
  World world(default_world(), 100, Clockwork::by_hand);
  const Eigen::Isometry3d arm_from_world = world.configuration().world_from_arm.inverse();
  const Eigen::Vector3d corner =
      world.configuration().left_m + world.configuration().separation_m * Eigen::Vector3d::UnitX();
  world.set_tool_source([&](double t) {
    return std::optional<Eigen::Vector3d>(arm_from_world * (corner + Eigen::Vector3d(0, 0.03 * std::sin(6 * t), 0)));
  });
  world.on_prompt({.step = "hang_still"}, 100);
  world.advance_to(102);
  world.on_prompt({.step = "robot_path"}, 102);
  world.advance_to(105);
  for (double t = 104; t < 105; t += 0.05)
    EXPECT_NEAR((world.markers_at(t)[1].position_m - corner - Eigen::Vector3d(0, 0.03 * std::sin(6 * t), 0)).norm(), 0,
                2e-5);
}

TEST(World, RunsOnTheHostsClock) {
  const double start = rig::host_now_s();
  World world(default_world(), start);
  world.on_prompt({.step = "hang_still"}, start);
  // The person takes as long to hang it as the machine takes to find how it hangs.
  double t = start;
  while (world.markers_at(t).empty() && t < start + 120) t = rig::host_now_s() + 0.05;
  EXPECT_GE(t, start + 1);
  EXPECT_LT(t, start + 120);
  EXPECT_GE(rig::host_now_s(), t);
}

}  // namespace
}  // namespace selvedge::hardware_sim
