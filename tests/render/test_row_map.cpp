#include "render/row_map.h"

#include <gtest/gtest.h>

#include "scene.h"

namespace selvedge::render {
namespace {

const auto kFlat = [](double, double) { return 0.0; };
const auto kFolded = [](double x, double z) { return 0.02 * std::sin(40 * x) + 0.1 * z; };

TEST(RowMap, FlatSheetGivesTheProjectorPixelOfTheRaysPoint) {
  const auto camera = bench_camera(), projector = bench_projector();
  const Sheet sheet = make_sheet(9, kFlat);
  RowMap map(camera, projector);
  map.rasterise(sheet.position, sheet.triangles);
  std::vector<float> row, column, depth;
  map.fill(row, column, depth);
  const Eigen::Vector3d eye = geometry::centre(camera);
  int seen = 0;
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x) {
      const Eigen::Vector3d ray = geometry::ray(camera, {x, y});
      const Eigen::Vector3d point = eye + ray * (-eye.y() / ray.y());
      const bool hit = std::abs(point.x()) <= 0.15 && point.z() <= 0 && point.z() >= -0.3;
      const size_t i = size_t(y) * 640 + x;
      ASSERT_EQ(map.triangle_ids()[i] >= 0, hit) << x << " " << y;
      ASSERT_EQ(std::isnan(row[i]), !hit);
      if (!hit) continue;
      ++seen;
      const Eigen::Vector2d lit = geometry::project(projector, point);
      ASSERT_NEAR(row[i], lit.y(), 2e-4);
      ASSERT_NEAR(column[i], lit.x(), 2e-4);
      ASSERT_NEAR(depth[i], geometry::depth(camera, point), 1e-6);
    }
  EXPECT_GT(seen, 70000);
}

TEST(RowMap, SubPixelSamplesLieOnTheSheetAndVaryContinuously) {
  const auto camera = bench_camera(), projector = bench_projector();
  const Sheet sheet = make_sheet(33, kFolded);
  RowMap map(camera, projector);
  map.rasterise(sheet.position, sheet.triangles);
  double last = 0, largest_step = 0;
  for (double y = 150; y < 350; y += 0.05) {
    const auto sample = map.at({300.3, y});
    ASSERT_TRUE(sample && sample->inside);
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    for (int i = 0; i < 3; ++i) point += sample->weights[i] * sheet.position.col(sheet.triangles[sample->triangle][i]);
    ASSERT_NEAR((geometry::project(camera, point) - Eigen::Vector2d(300.3, y)).norm(), 0, 1e-8);
    ASSERT_NEAR((geometry::project(projector, point) - Eigen::Vector2d(sample->column_px, sample->row_px)).norm(), 0,
                1e-8);
    ASSERT_NEAR(sample->depth_m, geometry::depth(camera, point), 1e-10);
    if (y > 150) largest_step = std::max(largest_step, std::abs(sample->row_px - last));
    last = sample->row_px;
    const auto next = map.at({300.3, y + 1e-4});
    if (next->triangle == sample->triangle) {
      ASSERT_NEAR((next->row_px - sample->row_px) / 1e-4, sample->row_gradient.y(), 1e-3);
    }
  }
  EXPECT_LT(largest_step, 0.05 * 3);
}

TEST(RowMap, NearerFoldHidesFartherOne) {
  const auto camera = bench_camera(), projector = bench_projector();
  Sheet sheet = make_sheet(2, kFlat);
  const Sheet front = make_sheet(2, [](double, double) { return -0.1; });
  Sheet both = sheet;
  both.position.conservativeResize(3, 8);
  both.position.rightCols(4) = front.position * 0.5;
  for (auto t : front.triangles) both.triangles.push_back({t[0] + 4, t[1] + 4, t[2] + 4});
  RowMap map(camera, projector);
  map.rasterise(both.position, both.triangles);
  const Eigen::Vector2d middle = geometry::project(camera, {0, -0.05, -0.07});
  EXPECT_GE(map.at(middle)->triangle, 2);
  EXPECT_LT(map.at(geometry::project(camera, {0.1, 0, -0.25}))->triangle, 2);

  // A second, smaller picture leaves nothing of the first behind.
  map.rasterise(front.position * 0.5, front.triangles);
  std::vector<unsigned char> inside;
  map.fill_silhouette(inside);
  EXPECT_EQ(inside[400 * 640 + 320], 0);
  EXPECT_FALSE(map.at(geometry::project(camera, {0.1, 0, -0.25})));
}

TEST(RowMap, LensDistortionIsTheGeometrysOwn) {
  auto camera = bench_camera(), projector = bench_projector();
  camera.distortion = {-0.12, 0.08, 1e-3, -5e-4, 0};
  projector.distortion = {0.05, 0, 0, 0, 0};
  const Sheet sheet = make_sheet(33, kFlat);
  RowMap map(camera, projector);
  map.rasterise(sheet.position, sheet.triangles);
  const Eigen::Vector3d eye = geometry::centre(camera);
  int checked = 0;
  for (double y = 130; y < 330; y += 7.3)
    for (double x = 150; x < 400; x += 7.7) {
      const Eigen::Vector3d ray = geometry::ray(camera, {x, y});
      const Eigen::Vector3d point = eye + ray * (-eye.y() / ray.y());
      if (std::abs(point.x()) > 0.149 || point.z() > -0.001 || point.z() < -0.299) continue;
      const auto sample = map.at({x, y});
      ASSERT_TRUE(sample);
      ASSERT_NEAR(sample->row_px, geometry::project(projector, point).y(), 0.01);
      ++checked;
    }
  EXPECT_GT(checked, 500);
}

}  // namespace
}  // namespace selvedge::render
