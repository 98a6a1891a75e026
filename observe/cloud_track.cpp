#include "observe/cloud_track.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <boost/math/distributions/chi_squared.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/trial/trial_summary.h"
#include "files/bad_input.h"
#include "geometry/order_statistics.h"
#include "observe/kept_frames.h"
#include "observe/silhouette.h"

namespace selvedge::observe {

namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using trial::Cloud;

constexpr int kPictureSide_px = 640;
constexpr int kMargin_px = 12;
constexpr double kSquaresOnFabric = 600, kFewestSquares = 200;  // that a swatch has, laid flat
constexpr size_t kOutlinePoints = 160;
constexpr Index kLeastPoints = 16;    // of a cloud
constexpr size_t kForParabola = 12;   // points; it has six numbers
constexpr double kSpacingsASide = 4;  // of a square with points enough for that
constexpr double kLeastSd_mm = 0.05;

// Those that can be of the fabric: none of its points lies further from another than its diagonal is long. A depth
// camera puts what it did not see at its own place, and sees the wall.
Matrix3Xd of_fabric(const Matrix3Xd& points, double diagonal_m) {
  Vector3d middle;
  for (Index axis = 0; axis < 3; ++axis) {
    const Eigen::VectorXd along = points.row(axis);
    middle(axis) = geometry::median(std::vector<double>(along.begin(), along.end()));
  }
  std::vector<Index> kept;
  for (Index i = 0; i < points.cols(); ++i)
    if ((points.col(i) - middle).norm() <= diagonal_m) kept.push_back(i);
  return points(Eigen::all, kept);
}

std::vector<Cloud> clouds_of(const trial::Trial& trial) {
  const double diagonal_m = std::hypot(trial.fabric.width_m, trial.fabric.height_m);
  std::vector<Cloud> out = trial::clouds(*trial.surface);
  for (Cloud& c : out) c.points = of_fabric(c.points, diagonal_m);
  std::erase_if(out, [](const Cloud& c) { return c.points.cols() < kLeastPoints; });
  return out;
}

// Across which direction the clouds spread least, each about its own middle.
Vector3d flattest(const std::vector<Cloud>& clouds) {
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Cloud& c : clouds) {
    const Matrix3Xd about = c.points.colwise() - c.points.rowwise().mean();
    scatter += about * about.transpose() / static_cast<double>(about.cols());
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
}

// All points lie before the instrument, whichever way it is turned towards their middle, and not on top of it.
void require_seen_from(const trial::Trial& trial, const std::vector<Cloud>& clouds, const Vector3d& from,
                       const Vector3d& middle) {
  constexpr double kNearest = 0.05;  // of the way to their middle
  const Vector3d way = middle - from;
  for (const Cloud& c : clouds)
    if (!((way.transpose() * (c.points.colwise() - from)).minCoeff() > kNearest * way.squaredNorm()))
      refuse((trial.folder / "trial.json").string() + ": surface.seen_from_m",
             "found {:.3g}, {:.3g}, {:.3g}, which lies among the points, expected where the instrument stood, m",
             from.x(), from.y(), from.z());
}

// Its picture holds all the clouds.
geometry::Projection camera_for(const trial::Trial& trial, const std::vector<Cloud>& clouds) {
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Cloud& c : clouds) {
    low = low.cwiseMin(c.points.rowwise().minCoeff());
    high = high.cwiseMax(c.points.rowwise().maxCoeff());
  }
  const Vector3d middle = (low + high) / 2;
  constexpr double kLeastExtent = 0.05;  // of the swatch's width
  if (!((high - low).norm() > kLeastExtent * trial.fabric.width_m))
    refuse((trial.folder / "surface.csv").string(),
           "found all points within {:.3g} mm, expected a surface of about {:.3g} mm", 1e3 * (high - low).norm(),
           1e3 * trial.fabric.width_m);
  constexpr double kFarOff = 50;  // times the extent: rays are as good as parallel
  const Vector3d from = trial.surface->seen_from_m.value_or(middle + kFarOff * (high - low).norm() * flattest(clouds));
  const Vector3d up = std::abs((middle - from).normalized().z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitY();
  require_seen_from(trial, clouds, from, middle);
  const geometry::Projection camera =
      geometry::looking_at(from, middle, {1, 1}, {0, 0}, kPictureSide_px, kPictureSide_px, up);
  double reach = 0;  // tangent of the widest angle from the axis
  for (const Cloud& c : clouds)
    for (Index i = 0; i < c.points.cols(); ++i)
      reach = std::max(reach, geometry::project(camera, c.points.col(i)).cwiseAbs().maxCoeff());
  const double half = 0.5 * (kPictureSide_px - 1), focal_px = (half - kMargin_px) / std::max(reach, 1e-9);
  return geometry::looking_at(from, middle, {focal_px, focal_px}, {half, half}, kPictureSide_px, kPictureSide_px, up);
}

// A point as the camera has it.
struct Seen {
  Vector2d pixel;
  double depth_m;
};

using Squares = std::map<std::pair<long, long>, std::vector<Seen>>;

Squares squares_of(const geometry::Projection& camera, const Matrix3Xd& points, double side_px) {
  Squares out;
  for (Index i = 0; i < points.cols(); ++i) {
    const Vector2d pixel = geometry::project(camera, points.col(i)), at = (pixel / side_px).array().floor();
    out[{std::lround(at.x()), std::lround(at.y())}].push_back({pixel, geometry::depth(camera, points.col(i))});
  }
  return out;
}

// Depth over a square: c₀ + c₁x + c₂y + …, in half sides about its points' middle.
struct Parabola {
  Vector2d middle_px;
  double depth_m = 0;   // there
  double left_m = 0;    // root mean square of what it leaves, for each number that it has left free
  double leverage = 0;  // variance of depth_m over that of a point
  double freedom = 0;   // degrees of
};

Parabola parabola_through(const std::vector<Seen>& points, double side_px) {
  Parabola out;
  out.middle_px = Vector2d::Zero();
  for (const Seen& p : points) out.middle_px += p.pixel / static_cast<double>(points.size());
  const auto count = static_cast<Index>(points.size());
  Eigen::MatrixXd a(count, 6);
  Eigen::VectorXd depth(count);
  for (Index i = 0; i < count; ++i) {
    const Seen& p = points[static_cast<size_t>(i)];
    const Vector2d at = (p.pixel - out.middle_px) / (0.5 * side_px);
    a.row(i) << 1, at.x(), at.y(), at.x() * at.x(), at.x() * at.y(), at.y() * at.y();
    depth(i) = p.depth_m;
  }
  // Points on one line leave some numbers open: those are then small.
  const Eigen::MatrixXd normal = a.transpose() * a + 1e-6 * Eigen::MatrixXd::Identity(6, 6);
  const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
  const double mean = depth.mean();
  const Eigen::VectorXd c = solver.solve(a.transpose() * (depth.array() - mean).matrix());
  out.depth_m = mean + c(0);
  out.freedom = static_cast<double>(count - 6);
  out.left_m = std::sqrt(((depth.array() - mean).matrix() - a * c).squaredNorm() / out.freedom);
  out.leverage = solver.solve(Eigen::VectorXd::Unit(6, 0))(0);
  return out;
}

// Length along the ray through a pixel for a metre of depth.
double along_ray(const geometry::Projection& camera, const Vector2d& pixel) {
  return 1 / geometry::depth(camera, geometry::centre(camera) + geometry::ray(camera, pixel));
}

// Noise of a point along the optical axis, m: the lower quartile of what parabolas leave, since where fabric folds they
// leave more; as independent normal errors have it. side_px: of squares wide enough for a parabola. Nothing where there
// is none.
std::optional<double> noise_of(const geometry::Projection& camera, const std::vector<Cloud>& clouds, double side_px) {
  constexpr double kQuarter = 0.25, kLeastNoise_m = 5e-5;
  constexpr size_t kTimes = 12;
  std::vector<double> left;
  const size_t every = std::max<size_t>(1, clouds.size() / kTimes);
  for (size_t k = 0; k < clouds.size(); k += every)
    for (const auto& [at, points] : squares_of(camera, clouds[k].points, side_px)) {
      if (points.size() < kForParabola) continue;
      const Parabola p = parabola_through(points, side_px);
      left.push_back(p.left_m / std::sqrt(quantile(boost::math::chi_squared(p.freedom), kQuarter) / p.freedom));
    }
  if (left.empty()) return std::nullopt;
  const auto quarter = left.begin() + static_cast<std::ptrdiff_t>(left.size() / 4);
  std::nth_element(left.begin(), quarter, left.end());
  return std::max(kLeastNoise_m, *quarter);
}

const Seen& nearest_to_middle(const std::vector<Seen>& points, const Vector2d& middle) {
  return *std::min_element(points.begin(), points.end(), [&](const Seen& a, const Seen& b) {
    return (a.pixel - middle).squaredNorm() < (b.pixel - middle).squaredNorm();
  });
}

// What holds for all times of a recording.
struct Scanned {
  geometry::Projection camera;
  double side_px = 0, spacing_px = 0, noise_m = 0;
  bool is_dense = false;  // squares have points enough for a parabola; those of the rim that have not are left out
};

// What a square tells, if it is one surface and tells more than one of its points does.
std::optional<DepthPoint> depth_point(const Scanned& by, const std::vector<Seen>& points, const Vector2d& middle_px) {
  constexpr double kMostLeft = 3, kMostLeft_m = 1.5e-3;  // times the noise, and of narrow folds
  DepthPoint out;
  double sd_m = by.noise_m;
  if (by.is_dense) {
    if (points.size() < kForParabola) return std::nullopt;
    const Parabola p = parabola_through(points, by.side_px);
    if (p.leverage > 1 || p.left_m > std::max(kMostLeft * by.noise_m, kMostLeft_m)) return std::nullopt;
    out.pixel = p.middle_px;
    out.depth_m = p.depth_m;
    sd_m = std::max(by.noise_m, p.left_m) * std::sqrt(p.leverage);
  } else {
    const Seen& p = nearest_to_middle(points, middle_px);
    out.pixel = p.pixel;
    out.depth_m = p.depth_m;
  }
  out.ray_m_per_depth_m = along_ray(by.camera, out.pixel);
  out.sd_mm = std::max(kLeastSd_mm, 1e3 * sd_m * out.ray_m_per_depth_m);
  return out;
}

// The rim of the area that the points cover, and half of what lies beyond: the next points missed the fabric. Where
// between the two its edge lies nothing says, so it is known as what is spread evenly over a spacing.
// spacing_px: between neighbouring points.
std::vector<OutlinePoint> outline_of(const geometry::Projection& camera, const Matrix3Xd& points, double spacing_px) {
  cv::Mat covered = cv::Mat::zeros(camera.height_px, camera.width_px, CV_8U);
  double depth_m = 0;
  const int radius_px = static_cast<int>(std::ceil(1.5 * spacing_px));
  for (Index i = 0; i < points.cols(); ++i) {
    const Vector2d at = geometry::project(camera, points.col(i));
    cv::circle(covered, cv::Point(static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y()))),
               radius_px, cv::Scalar(255), cv::FILLED);
    depth_m += geometry::depth(camera, points.col(i)) / static_cast<double>(points.cols());
  }
  cv::erode(covered, covered,
            cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(2 * radius_px + 1, 2 * radius_px + 1)));
  const Image picture = Eigen::Map<const Image>(covered.data, covered.rows, covered.cols);
  const std::vector<unsigned char> inside(picture.data(), picture.data() + picture.size());
  const double mm_per_px = 1e3 * depth_m / geometry::decompose(camera).intrinsics(0, 0);
  const double sd_mm = std::max(1.0, spacing_px) * mm_per_px / std::sqrt(12);
  std::vector<OutlinePoint> out;
  for (const SilhouettePoint& p : outline_points(picture, inside, {0, 1}))
    out.push_back({p.pixel + 0.5 * spacing_px * p.normal, p.normal, mm_per_px, sd_mm});
  return every_nth(out, kOutlinePoints);
}

// Between neighbouring points, were they spread evenly over the area that they cover.
double spacing_of(const geometry::Projection& camera, const Matrix3Xd& points) {
  std::vector<cv::Point2f> pixels, hull;
  for (Index i = 0; i < points.cols(); ++i) {
    const Vector2d p = geometry::project(camera, points.col(i));
    pixels.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  }
  cv::convexHull(pixels, hull);
  return std::sqrt(cv::contourArea(hull) / static_cast<double>(points.cols()));
}

Scanned scanned_by(const trial::Trial& trial, const std::vector<Cloud>& clouds) {
  Scanned out{camera_for(trial, clouds)};
  const Matrix3Xd& first = clouds.front().points;
  const double px_per_m =
      geometry::decompose(out.camera).intrinsics(0, 0) / geometry::depth(out.camera, Vector3d(first.rowwise().mean()));
  const auto side_of = [&](double squares) {
    return px_per_m * std::sqrt(trial.fabric.width_m * trial.fabric.height_m / squares);
  };
  out.spacing_px = spacing_of(out.camera, first);
  const double wanted_px = kSpacingsASide * out.spacing_px;
  out.is_dense = wanted_px <= side_of(kFewestSquares);
  out.side_px = out.is_dense ? std::max(wanted_px, side_of(kSquaresOnFabric)) : side_of(kSquaresOnFabric);
  out.noise_m = noise_of(out.camera, clouds, std::max(out.side_px, wanted_px)).value_or(stated_noise_m(trial));
  return out;
}

StripeFrame frame_of(const Scanned& by, const Cloud& cloud, size_t index) {
  StripeFrame out;
  out.time_s = cloud.time_s;
  out.index = index;
  out.number = static_cast<int>(index);
  for (const auto& [at, seen] : squares_of(by.camera, cloud.points, by.side_px)) {
    const Vector2d middle =
        by.side_px * (Vector2d(static_cast<double>(at.first), static_cast<double>(at.second)) + Vector2d(0.5, 0.5));
    if (const auto point = depth_point(by, seen, middle)) out.depth.push_back(*point);
  }
  if (by.is_dense) out.outline = outline_of(by.camera, cloud.points, by.spacing_px);
  return out;
}

}  // namespace

std::shared_ptr<const StripeTrack> track_cloud(const trial::Trial& trial, const ObserveOptions& options, bool still) {
  const std::string file = (trial.folder / "surface.csv").string();
  const std::vector<Cloud> clouds = clouds_of(trial);
  if (clouds.empty())
    refuse(file, "found no time with {} points of a fabric or more, expected a surface", kLeastPoints);
  const Scanned by = scanned_by(trial, clouds);
  auto track = std::make_shared<StripeTrack>();
  track->of_cloud = true;
  track->camera = track->projector = by.camera;
  std::vector<double> times;
  for (const Cloud& c : clouds) times.push_back(c.time_s);
  for (const size_t i : kept_frames(times, options, still)) track->frames.push_back(frame_of(by, clouds[i], i));
  if (track->frames.empty())
    refuse(file, "found no time between {:.3f} and {:.3f} s, expected one", options.from_s, options.to_s);
  return track;
}

}  // namespace selvedge::observe
