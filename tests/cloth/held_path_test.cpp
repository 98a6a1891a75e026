// The recorded corners' path: smooth, true to the motion, whatever the tracker's timing.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "cloth/held_path.h"

namespace selvedge::cloth {
namespace {

Eigen::Vector3d truth(double t_s) {
  return {0.1 * std::sin(2 * M_PI * 1.1 * t_s), 0.05 * std::cos(2 * M_PI * 0.7 * t_s), 1.0};
}

double largest_error(const std::vector<double>& time_s, double noise_m) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, noise_m);
  Eigen::Matrix3Xd left(3, static_cast<Eigen::Index>(time_s.size()));
  for (size_t i = 0; i < time_s.size(); ++i)
    left.col(static_cast<Eigen::Index>(i)) =
        truth(time_s[i]) + Eigen::Vector3d(noise(random), noise(random), noise(random));
  const HeldPath path = smooth_path(Hold::corners, time_s, left, left, false);
  double largest = 0;
  for (double t = time_s.front(); t <= time_s.back(); t += 0.003)
    largest = std::max(largest, (path.at(t).col(0) - truth(t)).norm());
  return largest;
}

TEST(HeldPath, RegularSamplesAreSmoothed) {
  std::vector<double> time_s;
  for (int i = 0; i < 600; ++i) time_s.push_back(i / 120.0);
  EXPECT_LT(largest_error(time_s, 3e-4), 1.2e-3);  // a raw sample is up to 1.6 mm off
}

TEST(HeldPath, PairsOfSamplesAtAlmostOneTimeDoNoHarm) {
  std::vector<double> time_s;
  for (int i = 0; i < 120; ++i) {
    time_s.push_back(0.1 * i);
    time_s.push_back(0.1 * i + (i % 3 == 0 ? 1e-4 : 4e-4));
  }
  EXPECT_LT(largest_error(time_s, 1e-3), 0.01);
}

TEST(HeldPath, GapsAreBridged) {
  std::vector<double> time_s;
  for (int i = 0; i < 600; ++i)
    if (i < 200 || i > 215) time_s.push_back(i / 120.0);
  EXPECT_LT(largest_error(time_s, 3e-4), 3e-3);
}

}  // namespace
}  // namespace selvedge::cloth
