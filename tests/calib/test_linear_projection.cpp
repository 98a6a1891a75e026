// The direct linear transform and RANSAC around it.
#include <random>

#include <gtest/gtest.h>

#include "calib/linear_projection.h"
#include "hardware_sim/synthetic_grid/synthetic_poses.h"

namespace selvedge::calib {
namespace {

struct Pairs {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  geometry::Projection truth;
};

Pairs make_pairs(bool flat) {
  Pairs pairs;
  pairs.truth = hardware_sim::look_at({0, -2, 1}, {0, 0, 1}, {0, 0, 1}, 1400, {1280, 1024}, {});
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> unit(-0.3, 0.3);
  for (int i = 0; i < 60; ++i) {
    pairs.points.emplace_back(unit(generator), flat ? 0.0 : unit(generator), 1 + unit(generator));
    pairs.pixels.push_back(geometry::project(pairs.truth, pairs.points.back()));
  }
  return pairs;
}

TEST(linear_projection, is_exact_on_exact_pairs) {
  const Pairs pairs = make_pairs(false);
  const LinearProjection linear = direct_linear_transform(pairs.points, pairs.pixels);
  for (size_t i = 0; i < pairs.points.size(); ++i)
    EXPECT_LT(((linear.matrix * pairs.points[i].homogeneous()).hnormalized() - pairs.pixels[i]).norm(), 1e-6);
  EXPECT_LT(linear.singular_ratio, 1e-4);
}

TEST(linear_projection, shows_a_plane_in_its_singular_values) {
  Pairs pairs = make_pairs(true);
  std::mt19937 generator(4);
  std::normal_distribution<double> noise(0, 0.2);
  for (auto& pixel : pairs.pixels) pixel += Eigen::Vector2d(noise(generator), noise(generator));
  EXPECT_GT(direct_linear_transform(pairs.points, pairs.pixels).singular_ratio, 0.3);
}

TEST(linear_projection, ransac_sees_through_forty_percent_of_wrong_pairs) {
  Pairs pairs = make_pairs(false);
  for (size_t i = 0; i < 24; ++i) pairs.pixels[i] += Eigen::Vector2d(60 + 3.0 * static_cast<double>(i), -80);
  const LinearProjection linear = ransac_projection(pairs.points, pairs.pixels, {});
  for (size_t i = 0; i < 60; ++i) EXPECT_EQ(linear.inlier[i], i >= 24) << i;
}

}  // namespace
}  // namespace selvedge::calib
