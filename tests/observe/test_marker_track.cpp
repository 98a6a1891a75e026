// Thinning of tracked markers.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "observe/marker_track.h"

namespace selvedge::observe {
namespace {

// One marker on a path of the third order in time, at 120 Hz.
trial::Trial moving(double noise_m, Eigen::Vector3d (*path)(double)) {
  trial::Trial t;
  t.mocap_noise_m = noise_m;
  trial::Markers m;
  std::vector<Eigen::Vector3d> seen;
  std::mt19937 generator(4);
  std::normal_distribution<double> noise(0, noise_m);
  for (int i = 0; i < 1200; ++i) {
    m.time_s.push_back(i / 120.0);
    m.marker.push_back(0);
    m.uv.emplace_back(0.1, 0.1);
    seen.push_back(path(i / 120.0) + Eigen::Vector3d(noise(generator), noise(generator), noise(generator)));
  }
  m.position.resize(3, static_cast<Eigen::Index>(seen.size()));
  for (size_t i = 0; i < seen.size(); ++i) m.position.col(static_cast<Eigen::Index>(i)) = seen[i];
  t.markers = std::move(m);
  return t;
}

Eigen::Vector3d curve(double s) { return {0.3 * s, 2 * s * s, 1}; }

TEST(MarkerTrack, AveragingKeepsAParabolaAndTellsItsNoise) {
  ObserveOptions options;
  options.rate_hz = 30;
  options.thinning = Thinning::averaged;
  const MarkerTrack exact = track_markers(moving(0, curve), options, false);
  for (size_t j = 1; j + 1 < exact.time_s.size(); ++j)
    EXPECT_LT((exact.position.col(static_cast<Eigen::Index>(j)) - curve(exact.time_s[j])).norm(), 1e-9);
  const MarkerTrack noisy = track_markers(moving(1e-3, curve), options, false);
  double square = 0, count = 0;
  for (size_t j = 1; j + 1 < noisy.time_s.size(); ++j) {
    square += (noisy.position.col(static_cast<Eigen::Index>(j)) - curve(noisy.time_s[j])).squaredNorm();
    count += 3;
  }
  EXPECT_LT(noisy.noise_m, 0.75e-3);
  EXPECT_NEAR(std::sqrt(square / count), noisy.noise_m, 0.1 * noisy.noise_m);
}

TEST(MarkerTrack, DroppingKeepsSamplesAsTheyWere) {
  const trial::Trial t = moving(1e-3, curve);
  const MarkerTrack track = track_markers(t, {}, false);
  EXPECT_EQ(track.noise_m, 1e-3);
  for (size_t j = 0; j < track.time_s.size(); ++j)
    EXPECT_EQ(track.position.col(static_cast<Eigen::Index>(j)),
              t.markers->position.col(std::lround(120 * track.time_s[j])));
}

TEST(MarkerTrack, AStillMarkersMeanHasTheNoiseOfAMean) {
  ObserveOptions options;
  options.thinning = Thinning::averaged;
  const MarkerTrack track = track_markers(moving(1e-3, [](double) { return Eigen::Vector3d(1, 2, 3); }), options, true);
  ASSERT_EQ(track.position.cols(), 1);
  EXPECT_NEAR(track.noise_m, 1e-3 / std::sqrt(1200.0), 1e-9);
  EXPECT_LT((track.position.col(0) - Eigen::Vector3d(1, 2, 3)).norm(), 2e-4);
}

}  // namespace
}  // namespace selvedge::observe
