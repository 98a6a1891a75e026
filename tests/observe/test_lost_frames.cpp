// Frames that are missing though no stamp is.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "observe/lost_frames.h"
#include "observe/marker_track.h"

namespace selvedge::observe {
namespace {

constexpr double kRate_hz = 60;

// Nine markers that swing, of which the camera lost a frame before stamps 40 and 80, and two before 110.
trial::Markers swinging(double noise_m, bool loses) {
  trial::Markers m;
  std::vector<Eigen::Vector3d> seen;
  std::mt19937 generator(6);
  std::normal_distribution<double> noise(0, noise_m);
  for (int i = 0; i < 150; ++i) {
    const int frame = i + (loses ? (i >= 40) + (i >= 80) + 2 * (i >= 110) : 0);
    for (int k = 0; k < 9; ++k) {
      const double phase = 7 * frame / kRate_hz + 0.2 * k;
      m.time_s.push_back(i / kRate_hz);
      m.marker.push_back(k);
      m.uv.emplace_back(0.1 * (k % 3), 0.1 * (k / 3));
      seen.emplace_back(0.05 * std::sin(phase) + noise(generator), 0.04 * std::cos(phase) + noise(generator),
                        noise(generator));
    }
  }
  m.position.resize(3, static_cast<Eigen::Index>(seen.size()));
  for (size_t i = 0; i < seen.size(); ++i) m.position.col(static_cast<Eigen::Index>(i)) = seen[i];
  return m;
}

TEST(LostFrames, AreSeenInHowMarkersMove) {
  const std::vector<LostFrames> lost = lost_frames(swinging(7e-4, true), 7e-4);
  ASSERT_EQ(lost.size(), 3U);
  const double stamps[] = {40, 80, 110}, counts[] = {1, 1, 2};
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(lost[k].to_s, stamps[k] / kRate_hz, 1e-9);
    EXPECT_NEAR(lost[k].from_s, (stamps[k] - 1) / kRate_hz, 1e-9);
    EXPECT_EQ(lost[k].count, counts[k]);
  }
}

TEST(LostFrames, AreNoneWhereNoneIsMissing) {
  EXPECT_TRUE(lost_frames(swinging(7e-4, false), 7e-4).empty());
  EXPECT_TRUE(lost_frames(swinging(0, false), 3e-4).empty());
  EXPECT_TRUE(lost_frames(swinging(1e-2, true), 1e-2).empty()) << "what noise hides is not told";
}

// A gap that the stamps show is no lost frame: they are right.
TEST(LostFrames, AreNoGapInTheStamps) {
  trial::Markers m = swinging(7e-4, true);
  for (double& t : m.time_s) {
    const long i = std::lround(t * kRate_hz);
    t += ((i >= 40) + (i >= 80) + 2 * (i >= 110)) / kRate_hz;
  }
  EXPECT_TRUE(lost_frames(m, 7e-4).empty());
}

TEST(LostFrames, AreNotAveragedOver) {
  trial::Trial t;
  t.mocap_noise_m = 1e-6;
  t.markers = swinging(0, true);
  ObserveOptions options;
  options.rate_hz = 12;
  options.thinning = Thinning::averaged;
  const MarkerTrack track = track_markers(t, options, false);
  EXPECT_EQ(track.lost.size(), 3U);
  const StampDrift stamps{-1 / kRate_hz, 0, track.lost, 1};
  for (size_t j = 1; j + 1 < track.time_s.size(); ++j) {
    const double phase = 7 * stamps.shown_at(track.time_s[j]);
    EXPECT_LT((track.position.col(static_cast<Eigen::Index>(j)) -
               Eigen::Vector3d(0.05 * std::sin(phase), 0.04 * std::cos(phase), 0))
                  .norm(),
              2e-3)
        << track.time_s[j];
  }
}

TEST(StampDrift, GrowsSteadilyOrAtLostFramesAlone) {
  const StampDrift steady{0.01, 1, {}, 0}, at_losses{-0.02, 0, {{0.5, 0.51, 1}, {0.8, 0.81, 2}}, 0.5};
  EXPECT_NEAR(steady.shown_at(3), 2.98, 1e-12);
  EXPECT_NEAR(at_losses.shown_at(0.5), 0.5, 1e-12);
  EXPECT_NEAR(at_losses.shown_at(0.6), 0.61, 1e-12);
  EXPECT_NEAR(at_losses.shown_at(1), 1.03, 1e-12);
  for (const StampDrift& d : {steady, at_losses, StampDrift{0.008, 0, at_losses.lost, 0.5}})
    for (const double stamp : {0.1, 0.5, 0.503, 0.7, 0.805, 2.0})
      EXPECT_NEAR(d.stamp_of(d.shown_at(stamp)), stamp, 1e-9) << d.per_s << " " << stamp;
}

}  // namespace
}  // namespace selvedge::observe
