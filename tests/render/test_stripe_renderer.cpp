#include "render/stripe_renderer.h"

#include <thread>

#include <gtest/gtest.h>

#include "render/row_map.h"
#include "scene.h"

namespace selvedge::render {
namespace {

const auto kWavy = [](double x, double z) { return 0.02 * std::sin(30 * x) + 0.01 * std::sin(25 * z); };

TEST(StripeRenderer, StripesLieWhereTheRowMapPutsThem) {
  const auto camera = bench_camera(), projector = bench_projector();
  const Sheet sheet = make_sheet(33, kWavy);
  const StripePattern pattern{.horizontal = true, .period_px = 16, .duty = 0.5, .first_bright_px = 3};
  StripeRenderer renderer(camera, projector, {.projector_blur_px = 0.3});
  renderer.set_pattern(pattern);
  const Image image = renderer.render(sheet.position, sheet.triangles);
  ASSERT_EQ(image.rows(), 480);
  ASSERT_EQ(image.cols(), 640);

  RowMap map(camera, projector);
  map.rasterise(sheet.position, sheet.triangles);
  std::vector<float> row, column, depth;
  map.fill(row, column, depth);
  int bright = 0, dark = 0, wrong = 0;
  for (int y = 1; y < 479; ++y)
    for (int x = 1; x < 639; ++x) {
      const size_t i = size_t(y) * 640 + x;
      const bool inner = !std::isnan(row[i - 1] + row[i + 1] + row[i - 640] + row[i + 640] + row[i]);
      const bool outer = std::isnan(row[i - 1]) && std::isnan(row[i + 1]) && std::isnan(row[i - 640]) &&
                         std::isnan(row[i + 640]) && std::isnan(row[i]);
      if (outer) { ASSERT_EQ(image(y, x), 4) << x << " " << y; }
      if (!inner) continue;
      const double phase = std::fmod(row[i] - 2.5 + 1600, 16.0);
      if (phase > 2.5 && phase < 5.5) ++bright, wrong += image(y, x) < 100;
      if (phase > 10.5 && phase < 13.5) ++dark, wrong += image(y, x) < 15 || image(y, x) > 17;
    }
  EXPECT_GT(bright, 8000);
  EXPECT_GT(dark, 8000);
  EXPECT_EQ(wrong, 0);
}

TEST(StripeRenderer, VerticalStripesFollowColumnsAndUniformLightIsSmooth) {
  const auto camera = bench_camera(), projector = bench_projector();
  const Sheet sheet = make_sheet(9, [](double, double) { return 0.0; });
  StripeRenderer renderer(camera, projector);
  renderer.set_pattern({.horizontal = false, .period_px = 40, .duty = 0.5, .first_bright_px = 0});
  const Image image = renderer.render(sheet.position, sheet.triangles);
  for (double x = -0.14; x < 0.14; x += 0.003) {
    const Eigen::Vector3d point(x, 0, -0.15);
    const double phase = std::fmod(geometry::project(projector, point).x(), 40.0);
    const Eigen::Vector2d pixel = geometry::project(camera, point);
    const int grey = image(int(std::lround(pixel.y())), int(std::lround(pixel.x())));
    if (phase > 5 && phase < 15) { EXPECT_GT(grey, 180); }
    if (phase > 25 && phase < 35) { EXPECT_LT(grey, 18); }
  }
  renderer.set_pattern({.duty = 1});
  const Image bright = renderer.render(sheet.position, sheet.triangles);
  renderer.set_pattern({.duty = 0});
  const Image dark = renderer.render(sheet.position, sheet.triangles);
  EXPECT_GT(bright(240, 320), 180);
  EXPECT_EQ(dark(240, 320), 16);
}

TEST(StripeRenderer, AFlapInFrontThrowsAShadow) {
  const auto camera = bench_camera(), projector = bench_projector();
  const Sheet back = make_sheet(9, [](double, double) { return 0.0; });
  Sheet both = back;
  const int count = int(back.position.cols());
  both.position.conservativeResize(3, count + 4);
  both.position.col(count) = Eigen::Vector3d(-0.02, -0.2, 0.02);
  both.position.col(count + 1) = Eigen::Vector3d(0.02, -0.2, 0.02);
  both.position.col(count + 2) = Eigen::Vector3d(-0.02, -0.2, -0.02);
  both.position.col(count + 3) = Eigen::Vector3d(0.02, -0.2, -0.02);
  both.triangles.push_back({count, count + 1, count + 2});
  both.triangles.push_back({count + 1, count + 3, count + 2});
  StripeRenderer renderer(camera, projector);
  renderer.set_pattern({.duty = 1});
  const Image image = renderer.render(both.position, both.triangles);
  // The lamp's ray through the flap's middle meets the back sheet here.
  const Eigen::Vector3d lamp = geometry::centre(projector), flap(0, -0.2, 0);
  const Eigen::Vector3d shadow = lamp + (flap - lamp) * (lamp.y() / (lamp.y() - flap.y()));
  const Eigen::Vector2d at = geometry::project(camera, shadow);
  EXPECT_EQ(image(int(at.y()), int(at.x())), 16);
  EXPECT_GT(image(int(at.y()) + 80, int(at.x())), 150);
}

TEST(StripeRenderer, TwoThreadsGetTheirOwnPictures) {
  const auto camera = bench_camera(), projector = bench_projector();
  const Sheet sheet = make_sheet(17, kWavy);
  StripeRenderer alone(camera, projector);
  const Image expected = alone.render(sheet.position, sheet.triangles);
  Image got[2];
  std::vector<std::thread> threads;
  for (int i = 0; i < 2; ++i)
    threads.emplace_back([&, i] {
      StripeRenderer renderer(camera, projector);
      for (int k = 0; k < 5; ++k) got[i] = renderer.render(sheet.position, sheet.triangles);
    });
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(got[0], expected);
  EXPECT_EQ(got[1], expected);
}

}  // namespace
}  // namespace selvedge::render
