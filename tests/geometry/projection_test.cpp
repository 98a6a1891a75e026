#include "geometry/projection.h"

#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace selvedge::geometry {
namespace {

struct Known {
  Projection projection;
  Eigen::Matrix3d intrinsics, rotation;
  Eigen::Vector3d centre;
};

// A camera at a known place; `scale` shows that nothing depends on the sign or size of P.
Known known_camera(double scale, double distortion) {
  Known known;
  known.intrinsics << 900, 2, 320, 0, 880, 240, 0, 0, 1;
  known.rotation = (Eigen::AngleAxisd(1.4, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()))
                       .toRotationMatrix();
  known.centre = {0.1, -1.2, 0.3};
  Eigen::Matrix<double, 3, 4> pose;
  pose << known.rotation, -known.rotation * known.centre;
  known.projection.matrix = scale * known.intrinsics * pose;
  known.projection.width_px = 640;
  known.projection.height_px = 480;
  known.projection.distortion = {-0.2 * distortion, 0.05 * distortion, 1e-3 * distortion, -5e-4 * distortion,
                                 0.01 * distortion};
  return known;
}

class ProjectionTest : public testing::TestWithParam<double> {};

TEST_P(ProjectionTest, DecomposesIntoItsParts) {
  const Known known = known_camera(GetParam(), 0);
  const Decomposition parts = decompose(known.projection);
  EXPECT_LT((parts.intrinsics - known.intrinsics).norm(), 1e-9);
  EXPECT_LT((parts.rotation_camera_from_world - known.rotation).norm(), 1e-12);
  EXPECT_LT((parts.translation_camera_from_world + known.rotation * known.centre).norm(), 1e-9);
  EXPECT_LT((centre(known.projection) - known.centre).norm(), 1e-12);
}

TEST_P(ProjectionTest, RayPassesThroughThePointItSees) {
  for (const double distortion : {0.0, 1.0}) {
    const Known known = known_camera(GetParam(), distortion);
    const Eigen::Vector3d point(0.15, 0.2, 0.05);
    const Eigen::Vector2d pixel = project(known.projection, point);
    const Eigen::Vector3d along = ray(known.projection, pixel);
    EXPECT_LT((point - known.centre).cross(along).norm(), 1e-9);
    EXPECT_GT((point - known.centre).dot(along), 0);
    EXPECT_NEAR(depth(known.projection, point), (known.rotation * (point - known.centre)).z(), 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(Scales, ProjectionTest, testing::Values(1.0, -3.0));

TEST(Projection, DistortionFollowsTheModel) {
  const Known known = known_camera(1, 1);
  const Eigen::Vector3d point(0.3, 0.1, -0.1);
  const Eigen::Vector3d seen = known.rotation * (point - known.centre);
  const double x = seen.x() / seen.z(), y = seen.y() / seen.z(), r2 = x * x + y * y;
  const auto& [k1, k2, p1, p2, k3] = known.projection.distortion;
  const double radial = 1 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
  const Eigen::Vector3d bent(x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                             y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y, 1);
  EXPECT_LT((project(known.projection, point) - (known.intrinsics * bent).head<2>()).norm(), 1e-9);
}

TEST(Projection, RankBelowThreeShows) {
  Eigen::Matrix<double, 3, 4> matrix = known_camera(1, 0).projection.matrix;
  EXPECT_GT(singular_values(matrix)(2) / singular_values(matrix)(0), 1e-3);
  matrix.row(2) = 0.3 * matrix.row(0) - 2 * matrix.row(1);
  EXPECT_LT(singular_values(matrix)(2) / singular_values(matrix)(0), 1e-12);
}

}  // namespace
}  // namespace selvedge::geometry
