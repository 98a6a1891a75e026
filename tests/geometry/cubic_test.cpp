// Cubics between samples, and the medians beside them.
#include "geometry/cubic.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "geometry/order_statistics.h"

namespace selvedge::geometry {
namespace {

TEST(CubicSpline, FollowsASineWithItsVelocity) {
  std::vector<double> times;
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i <= 120; ++i) {
    times.push_back(i / 60.0);
    places.emplace_back(std::sin(3 * times.back()), times.back(), 1);
  }
  const CubicSpline spline(times, places);
  for (double t = 0.2; t < 1.8; t += 0.013) {
    EXPECT_NEAR(spline.position(t).x(), std::sin(3 * t), 1e-6);
    EXPECT_NEAR(spline.velocity(t).x(), 3 * std::cos(3 * t), 1e-3);
    EXPECT_NEAR(spline.velocity(t).y(), 1, 1e-9);
  }
  EXPECT_TRUE(std::isinf(spline.gap_s(2.5)));
}

TEST(Cubics, AreExactForACubicAndMeetTheirSamples) {
  const auto cubic = [](double t) { return 1 + t * (2 + t * (-3 + t)); };
  const auto rate = [](double t) { return 2 + t * (-6 + 3 * t); };
  const double from = 0.3, length = 0.5;
  for (const double x : {0.0, 0.25, 0.8, 1.0})
    EXPECT_NEAR(hermite(x, length, cubic(from), rate(from), cubic(from + length), rate(from + length)),
                cubic(from + x * length), 1e-12);
  // Slopes from neighbours are those of a parabola.
  const auto parabola = [](double t) { return 4 - t * (1 - 2 * t); };
  for (const double x : {0.0, 0.4, 1.0})
    EXPECT_NEAR(catmull_rom(x, parabola(-1), parabola(0), parabola(1), parabola(2)), parabola(x), 1e-12);
}

TEST(OrderStatistics, TheMedianIsTheMiddleOrTheUpperOfTwo) {
  EXPECT_EQ(median(std::vector<int>{5, 1, 9}), 5);
  EXPECT_EQ(median(std::vector<double>{4, 1, 3, 2}), 3);
}

TEST(OrderStatistics, ALevelHasItsShareAtOrBelowIt) {
  const std::array<int, 4> histogram = {2, 0, 5, 3};
  EXPECT_EQ(level_of_share(histogram, 0.2, 10), 0);
  EXPECT_EQ(level_of_share(histogram, 0.21, 10), 2);
  EXPECT_EQ(level_of_share(histogram, 1, 10), 3);
}

}  // namespace
}  // namespace selvedge::geometry
