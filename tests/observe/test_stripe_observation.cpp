#include "observe/stripe_observation.h"
#include "observe/stripe_residual.h"

#include <filesystem>
#include <map>
#include <random>

#include <Eigen/Dense>

#include <gtest/gtest.h>

#include "capture/trial/trial.h"
#include "render/row_map.h"
#include "render/stripe_renderer.h"
#include "tests/render/scene.h"

namespace selvedge::observe {
namespace {

using render::Sheet;

double wave(double x, double z) { return 0.012 * std::sin(30 * x) + 0.008 * std::sin(25 * z) + 0.05 * z; }

render::Image picture(const geometry::Projection& camera, const geometry::Projection& projector,
                      const StripePattern& pattern, const Sheet& sheet, double noise_grey, double camera_blur_px) {
  render::RenderOptions options;
  options.camera_blur_px = camera_blur_px;
  render::StripeRenderer renderer(camera, projector, options);
  renderer.set_pattern(pattern);
  render::Image image = renderer.render(sheet.position, sheet.triangles);
  std::mt19937 random(4);
  std::normal_distribution<double> normal(0, noise_grey);
  for (Eigen::Index i = 0; i < image.size(); ++i)
    image.data()[i] = static_cast<unsigned char>(std::clamp(image.data()[i] + std::lround(normal(random)), 0L, 255L));
  return image;
}

struct Misses {
  int edges = 0, labelled = 0, wrong_label = 0;
  double square = 0;
};

// Labelled edges against the row that the true surface has at their pixel; those in shadow or beside an
// outline excepted.
Misses misses(const observe::StripeObservation& seen, const render::RowMap& truth, const StripePattern& pattern) {
  Misses m;
  for (const observe::StripeEdge& edge : seen.edges) {
    ++m.edges;
    if (!edge.labelled) continue;
    ++m.labelled;
    const auto sample = truth.at(edge.pixel);
    if (!sample) continue;
    const double miss = edge.projector_px - (pattern.horizontal ? sample->row_px : sample->column_px);
    if (std::abs(miss) > 0.25 * pattern.period_px) ++m.wrong_label;
    else m.square += miss * miss;
  }
  return m;
}

TEST(StripeObservation, EdgesOfARenderedSheetLieOnTheirRows) {
  auto camera = render::bench_camera();
  const auto projector = render::bench_projector();
  camera.distortion = {-0.05, 0.01, 0, 0, 0};
  const Sheet sheet = render::make_sheet(33, wave);
  const StripePattern pattern{.horizontal = true, .period_px = 16, .duty = 0.5, .first_bright_px = 5};
  observe::StripeObservation seen =
      observe::observe_stripes(picture(camera, projector, pattern, sheet, 1, 0.5), camera, projector, pattern);
  EXPECT_NEAR(seen.noise_grey, 1, 0.15);
  EXPECT_TRUE(seen.scans_columns);
  label_edges(seen, camera, projector, pattern, sheet.position.col(0), sheet.position.col(32));
  render::RowMap truth(camera, projector);
  truth.rasterise(sheet.position, sheet.triangles);
  const Misses m = misses(seen, truth, pattern);
  EXPECT_GT(m.edges, 8000);
  EXPECT_GT(m.labelled, 0.98 * m.edges);
  EXPECT_EQ(m.wrong_label, 0);
  EXPECT_LT(std::sqrt(m.square / m.labelled), 0.12);  // projector rows; 0.2 mm of depth

  // Triangulated points lie on the sheet.
  double square = 0;
  int count = 0;
  for (size_t i = 0; i < seen.edges.size(); i += 7) {
    const observe::StripeEdge& edge = seen.edges[i];
    if (!edge.labelled) continue;
    const auto point = triangulate(camera, projector, pattern, edge.pixel, edge.projector_px);
    ASSERT_TRUE(point);
    const double miss = point->y() - wave(point->x(), point->z());
    square += miss * miss;
    ++count;
  }
  EXPECT_LT(std::sqrt(square / count), 3e-4);
}

TEST(StripeObservation, VerticalStripesAreReadAlongRows) {
  const auto camera = geometry::looking_at({-0.3, -1.0, -0.15}, {0, 0, -0.15}, 1000, 640, 480);
  const auto projector = geometry::looking_at({0.3, -0.9, -0.1}, {0, 0, -0.15}, 1450, 1024, 768);
  const Sheet sheet = render::make_sheet(33, wave);
  const StripePattern pattern{.horizontal = false, .period_px = 20, .duty = 0.4, .first_bright_px = 3};
  observe::StripeObservation seen =
      observe::observe_stripes(picture(camera, projector, pattern, sheet, 1, 0), camera, projector, pattern);
  EXPECT_FALSE(seen.scans_columns);
  label_edges(seen, camera, projector, pattern, sheet.position.col(0), sheet.position.col(32));
  render::RowMap truth(camera, projector);
  truth.rasterise(sheet.position, sheet.triangles);
  const Misses m = misses(seen, truth, pattern);
  EXPECT_GT(m.labelled, 0.9 * m.edges);
  EXPECT_GT(m.labelled, 4000);
  EXPECT_EQ(m.wrong_label, 0);
  EXPECT_LT(std::sqrt(m.square / m.labelled), 0.2);
}

// A camera on its side sees the same sheet as well as one that stands upright.
TEST(StripeResidual, ACameraOnItsSideKnowsDepthAsWell) {
  const auto upright = render::bench_camera(), projector = render::bench_projector();
  auto rolled = upright;
  Eigen::Matrix3d quarter_turn;
  quarter_turn << 0, -1, upright.height_px - 1, 1, 0, 0, 0, 0, 1;
  rolled.matrix = quarter_turn * upright.matrix;
  std::swap(rolled.width_px, rolled.height_px);
  const Sheet sheet = render::make_sheet(33, wave);
  const StripePattern pattern;
  const auto median_sd_mm = [&](const geometry::Projection& camera, bool scans_columns) {
    StripeObservation seen =
        observe_stripes(picture(camera, projector, pattern, sheet, 1, 0.7), camera, projector, pattern);
    EXPECT_EQ(seen.scans_columns, scans_columns);
    label_edges(seen, camera, projector, pattern, sheet.position.col(0), sheet.position.col(32));
    std::vector<double> sd_mm;
    for (const DepthPoint& p : depth_points(seen, camera, projector, pattern)) sd_mm.push_back(p.sd_mm);
    EXPECT_GT(sd_mm.size(), 1000u);
    std::nth_element(sd_mm.begin(), sd_mm.begin() + static_cast<std::ptrdiff_t>(sd_mm.size() / 2), sd_mm.end());
    return sd_mm[sd_mm.size() / 2];
  };
  const double of_upright = median_sd_mm(upright, true);
  EXPECT_NEAR(median_sd_mm(rolled, false), of_upright, 0.1 * of_upright);
}

// A sheet's border in the image, and how far a point lies from it, px.
class Border {
 public:
  Border(const Sheet& sheet, int n, const geometry::Projection& camera) {
    const auto add = [&](int vertex) { at_.push_back(geometry::project(camera, sheet.position.col(vertex))); };
    for (int i = 0; i < n; ++i) add(i);
    for (int i = 1; i < n; ++i) add(n * i + n - 1);
    for (int i = 1; i < n; ++i) add(n * (n - 1) + n - 1 - i);
    for (int i = 1; i < n; ++i) add(n * (n - 1 - i));
  }
  double distance(const Eigen::Vector2d& p) const {
    double nearest = 1e9;
    for (size_t i = 0; i + 1 < at_.size(); ++i) {
      const Eigen::Vector2d side = at_[i + 1] - at_[i];
      const double t = std::clamp((p - at_[i]).dot(side) / side.squaredNorm(), 0.0, 1.0);
      nearest = std::min(nearest, (at_[i] + t * side - p).norm());
    }
    return nearest;
  }

 private:
  std::vector<Eigen::Vector2d> at_;
};

TEST(StripeObservation, OutlineIsFoundToAFewTenthsOfAPixel) {
  const auto camera = render::bench_camera(), projector = render::bench_projector();
  const Sheet sheet = render::make_sheet(33, wave);
  const StripePattern pattern;
  const observe::StripeObservation seen =
      observe::observe_stripes(picture(camera, projector, pattern, sheet, 1, 0.7), camera, projector, pattern);
  render::RowMap truth(camera, projector);
  truth.rasterise(sheet.position, sheet.triangles);
  std::vector<unsigned char> inside;
  truth.fill_silhouette(inside);
  int wrong = 0, area = 0;
  for (size_t i = 0; i < inside.size(); ++i) wrong += inside[i] != seen.inside[i], area += inside[i];
  EXPECT_LT(wrong, 0.006 * area);

  const Border border(sheet, 33, camera);
  double square = 0;
  for (const observe::SilhouettePoint& point : seen.silhouette) {
    const double nearest = border.distance(point.pixel);
    square += nearest * nearest;
  }
  ASSERT_GT(seen.silhouette.size(), 200u);
  EXPECT_LT(std::sqrt(square / double(seen.silhouette.size())), 0.35);
}

// Beside a stripe that runs along the lower edge the fabric looks as if it ended where the stripe does.
TEST(StripeObservation, NoOutlineIsTakenFromStripesThatRunAlongIt) {
  const auto camera = render::bench_camera(), projector = render::bench_projector();
  const Sheet sheet = render::make_sheet(33, wave);
  const StripePattern pattern;
  const render::Image image = picture(camera, projector, pattern, sheet, 1, 0.7);
  const observe::StripeObservation seen = observe::observe_stripes(image, camera, projector, pattern);
  const Border border(sheet, 33, camera);
  const auto furthest_px = [&](const std::vector<observe::SilhouettePoint>& points) {
    double most = 0;
    for (const observe::SilhouettePoint& p : points) most = std::max(most, border.distance(p.pixel));
    return most;
  };
  EXPECT_GT(furthest_px(observe::outline_points(image, seen.inside, observe::measure_background(image))), 1.2);
  EXPECT_LT(furthest_px(seen.silhouette), 0.9);
}

TEST(StripeObservation, RecordedStripesPassThroughTheHeldCorners) {
  const std::filesystem::path folder = SELVEDGE_SOURCE_DIR "/../shared/campaigns/striped-none/static-1";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "SKIPPED: no recorded campaign at " << folder;
  const trial::Trial trial = trial::read_trial(folder);
  const StripePattern pattern{trial.pattern->orientation == "horizontal", trial.pattern->period_px, trial.pattern->duty,
                              trial.pattern->first_bright_row_px};
  observe::StripeObservation seen =
      observe::observe_stripes(trial::read_frame(trial, 0), *trial.camera, *trial.projector, pattern);
  const Eigen::Vector3d left = trial.corners.left.rowwise().mean(), right = trial.corners.right.rowwise().mean();
  const int labelled = label_edges(seen, *trial.camera, *trial.projector, pattern, left, right);
  EXPECT_GT(labelled, 12000);
  EXPECT_GT(labelled, 0.98 * double(seen.edges.size()));

  // A quadratic through the points within 40 mm of each corner meets it.
  for (const Eigen::Vector3d& corner : {left, right}) {
    std::vector<Eigen::Vector3d> near;
    for (const observe::StripeEdge& edge : seen.edges)
      if (edge.labelled)
        if (const auto p = triangulate(*trial.camera, *trial.projector, pattern, edge.pixel, edge.projector_px))
          if ((*p - corner).norm() < 0.04) near.push_back(*p - corner);
    ASSERT_GT(near.size(), 50u);
    Eigen::MatrixXd a(near.size(), 6);
    Eigen::VectorXd b(near.size());
    for (size_t i = 0; i < near.size(); ++i) {
      const double x = near[i].x(), z = near[i].z();
      a.row(Eigen::Index(i)) << 1, x, z, x * x, x * z, z * z;
      b(Eigen::Index(i)) = near[i].y();
    }
    EXPECT_NEAR(1e3 * a.colPivHouseholderQr().solve(b)(0), 0, 0.5);  // mm
  }
}

// A frame of 100 × 80 pixels with a point every 3, and one of outline every 7: squares of 20 pixels.
TEST(OneASquare, IsThePointNearestToItsMiddle) {
  StripeTrack track;
  track.camera = geometry::looking_at({0, -1, 0}, {0, 0, 0}, 500, 100, 80);
  track.frames.resize(2);
  for (StripeFrame& frame : track.frames)
    for (int y = 1; y < 80; ++y)
      for (int x = 1; x < 100; ++x) {
        if (x % 3 == 0 && y % 3 == 0) frame.depth.push_back({{x, y}, 0, 1, 1, 0.1});
        if (x % 7 == 0 && y % 7 == 0) frame.outline.push_back({{x, y}, {1, 0}, 2, 0.6});
      }
  const std::vector<bool> marked = one_a_square(track, 0.04);
  ASSERT_EQ(marked.size(), 2 * (track.frames[0].depth.size() + track.frames[0].outline.size()));
  size_t at = 0;
  const auto look = [&](const auto& points) {
    std::map<std::pair<long, long>, double> chosen, nearest;
    for (const auto& p : points) {
      const Eigen::Vector2d square = (p.pixel / 20).array().floor();
      const std::pair key{std::lround(square.x()), std::lround(square.y())};
      const double off = (p.pixel / 20 - square - Eigen::Vector2d(0.5, 0.5)).norm();
      nearest[key] = std::min(nearest.try_emplace(key, off).first->second, off);
      if (!marked[at++]) continue;
      EXPECT_TRUE(chosen.try_emplace(key, off).second) << "two in square " << key.first << ", " << key.second;
    }
    EXPECT_EQ(chosen, nearest);
  };
  for (const StripeFrame& frame : track.frames) {
    look(frame.depth);
    look(frame.outline);
  }
}

// Fabric that was seen where the simulated one is not.
TEST(StripeResidual, APointBesideTheFabricCountsHowFarBesideItLies) {
  const Sheet sheet = render::make_sheet(9, [](double, double) { return 0.0; });
  geometry::TriangleMesh mesh;
  mesh.triangles = sheet.triangles;
  StripeTrack track;
  track.camera = render::bench_camera();
  track.projector = render::bench_projector();
  StripeFrame frame;
  const std::vector<double> beyond_mm = {-1, 0.5, 2, 8, 40};  // the right edge
  for (const double mm : beyond_mm) {
    const Eigen::Vector3d at(0.15 + 1e-3 * mm, 0, -0.1);
    DepthPoint p;
    p.pixel = geometry::project(track.camera, at);
    p.depth_m = geometry::depth(track.camera, at);
    p.ray_m_per_depth_m = (at - geometry::centre(track.camera)).norm() / p.depth_m;
    frame.depth.push_back(p);
  }
  std::vector<double> residual_mm(beyond_mm.size());
  stripe_residuals(track, frame, mesh, rim_of(mesh), sheet.position, {}, residual_mm.data());
  for (size_t i = 0; i < beyond_mm.size(); ++i)
    EXPECT_NEAR(residual_mm[i], std::clamp(beyond_mm[i], 0.0, kMostBesideMm), 0.03 + 0.03 * std::abs(beyond_mm[i]));
}

}  // namespace
}  // namespace selvedge::observe
