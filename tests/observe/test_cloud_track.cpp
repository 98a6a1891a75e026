// What becomes of scanned clouds.
#include <cmath>
#include <filesystem>
#include <random>

#include <gtest/gtest.h>

#include "geometry/projection.h"
#include "observe/cloud_track.h"
#include "tests/refusal.h"

namespace selvedge::observe {
namespace {

// A swatch of 0.3 m that hangs in waves, scanned at 10 Hz; which points are hit differs from time to time.
constexpr double kWave_m = 0.02;
double depth_at(double x) { return kWave_m * std::sin(2 * M_PI * x / 0.15); }

trial::Trial scanned(double noise_m, int points, bool from_known) {
  trial::Trial t;
  t.fabric = {"test knit", 0.3, 0.3, 0.0144, true};
  trial::Surface surface;
  if (from_known) surface.seen_from_m = Eigen::Vector3d(0.2, -1, 0.1);
  std::mt19937 generator(11);
  std::uniform_real_distribution<double> place(-0.15, 0.15);
  std::normal_distribution<double> noise(0, noise_m);
  surface.position.resize(3, 5 * points);
  for (int i = 0; i < 5 * points; ++i) {
    surface.time_s.push_back(0.1 * (i / points));
    const double x = place(generator), z = place(generator) - 0.15;
    surface.position.col(i) = Eigen::Vector3d(x, depth_at(x) + noise(generator), z);
  }
  t.surface = std::move(surface);
  return t;
}

std::vector<Eigen::Vector3d> points_of(const StripeTrack& track) {
  std::vector<Eigen::Vector3d> out;
  for (const StripeFrame& f : track.frames)
    for (const DepthPoint& p : f.depth) out.push_back(place_of(track.camera, p));
  return out;
}

TEST(CloudTrack, SquaresLieOnTheSurfaceAndTellTheirNoise) {
  for (const bool from_known : {true, false}) {
    SCOPED_TRACE(from_known);
    const auto track = track_cloud(scanned(1e-3, 12000, from_known), {}, false);
    ASSERT_EQ(track->frames.size(), 5u);
    double square = 0, expected = 0, count = 0;
    for (const StripeFrame& f : track->frames) EXPECT_GT(f.depth.size(), 500u);
    const std::vector<Eigen::Vector3d> points = points_of(*track);
    for (const Eigen::Vector3d& p : points) square += std::pow(1e3 * (p.y() - depth_at(p.x())), 2);
    for (const StripeFrame& f : track->frames)
      for (const DepthPoint& p : f.depth) {
        expected += p.sd_mm * p.sd_mm;
        ++count;
      }
    // A square has some 18 points, of a parabola's middle: half a point's noise. The noise lies across the sheet.
    EXPECT_LT(std::sqrt(square / count), 0.7);
    EXPECT_NEAR(std::sqrt(square / expected), 1, 0.25);
  }
}

TEST(CloudTrack, SparsePointsStandForThemselves) {
  const auto track = track_cloud(scanned(1e-3, 400, true), {}, false);
  double expected = 0, count = 0;
  for (const StripeFrame& f : track->frames)
    for (const DepthPoint& p : f.depth) {
      expected += p.sd_mm * p.sd_mm;
      ++count;
    }
  for (const Eigen::Vector3d& p : points_of(*track)) EXPECT_LT(std::abs(p.y() - depth_at(p.x())), 5e-3);
  // Of waves as wide as four points are apart a parabola leaves more than the noise.
  EXPECT_GT(std::sqrt(expected / count), 0.9);
  EXPECT_LT(std::sqrt(expected / count), 4);
}

TEST(CloudTrack, TheOutlineIsTheFabrics) {
  const auto track = track_cloud(scanned(5e-4, 12000, false), {}, false);  // rays straight across the fabric
  for (const StripeFrame& f : track->frames) {
    EXPECT_GT(f.outline.size(), 60u);
    double square = 0;
    for (const OutlinePoint& p : f.outline) {
      const Eigen::Vector3d from = geometry::centre(track->camera), ray = geometry::ray(track->camera, p.pixel);
      const Eigen::Vector3d at = from - from.y() / ray.y() * ray;
      const double inside_m = std::min(0.15 - std::abs(at.x()), 0.15 - std::abs(at.z() + 0.15));  // of the rim
      EXPECT_LT(std::abs(inside_m), 8e-3) << at.transpose();
      square += std::pow(1e3 * inside_m / p.sd_mm, 2);
    }
    EXPECT_LT(std::sqrt(square / static_cast<double>(f.outline.size())), 2);
  }
}

TEST(CloudTrack, PointsBesideTheFabricAreLeftOut) {
  trial::Trial t = scanned(5e-4, 12000, true);
  // One point in fifty hangs in the air, up to 0.1 m before or behind the fabric.
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> off(-0.1, 0.1);
  for (Eigen::Index i = 0; i < t.surface->position.cols(); i += 50) t.surface->position(1, i) += off(generator);
  // One in twenty was not seen and lies at the instrument's place, one in twenty is of a wall.
  for (Eigen::Index i = 1; i < t.surface->position.cols(); i += 20)
    t.surface->position.col(i) = *t.surface->seen_from_m;
  for (Eigen::Index i = 2; i < t.surface->position.cols(); i += 20) t.surface->position(1, i) = 1.5;
  const auto track = track_cloud(t, {}, false);
  const std::vector<Eigen::Vector3d> points = points_of(*track);
  EXPECT_GT(points.size(), 5u * 300);
  for (const Eigen::Vector3d& p : points) EXPECT_LT(std::abs(p.y() - depth_at(p.x())), 4e-3);
}

TEST(CloudTrack, RefusesWhatIsNoSurface) {
  trial::Trial t = scanned(1e-3, 10, true);
  t.folder = "short";
  EXPECT_NE(refusal_of([&] {
              track_cloud(t, {}, false);
            }).find("short/surface.csv: found no time with 16 points of a fabric"),
            std::string::npos);
  // Units of another scale, and an instrument within the fabric.
  trial::Trial tiny = scanned(1e-6, 1000, true);
  tiny.surface->position *= 1e-3;
  EXPECT_NE(refusal_of([&] { track_cloud(tiny, {}, false); }).find("found all points within 0.4"), std::string::npos);
  for (const Eigen::Vector3d& from : {Eigen::Vector3d(0, 0, -0.15), Eigen::Vector3d(0.1, 0.01, -0.1)}) {
    trial::Trial amid = scanned(1e-3, 1000, true);
    amid.surface->seen_from_m = from;
    EXPECT_NE(refusal_of([&] { track_cloud(amid, {}, false); }).find("trial.json: surface.seen_from_m: found"),
              std::string::npos);
  }
  ObserveOptions late;
  late.from_s = 7;
  trial::Trial whole = scanned(1e-3, 1000, true);
  EXPECT_NE(refusal_of([&] { track_cloud(whole, late, false); }).find("found no time between 7.000"),
            std::string::npos);
}

}  // namespace
}  // namespace selvedge::observe
