#include "station/held_corners.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "observe/silhouette.h"
#include "observe/stripe_observation.h"

namespace selvedge::station {

namespace {

constexpr size_t kLeastPoints = 6;     // on a side edge
constexpr double kAcross = 0.7;        // an edge point's normal points so far sideways
constexpr int kLeastEdges = 8;         // of stripes, near a corner
constexpr double kCornerAgrees = 0.3;  // of a period: how far off the labelling of fit/ bears a corner

struct Line {
  Eigen::Vector2d point, direction;  // direction points up in the image
};

// Principal axis; points further than two pixels from it are left out once.
std::optional<Line> fit_line(std::vector<Eigen::Vector2d> points) {
  Line line;
  for (int round = 0; round < 2; ++round) {
    if (points.size() < kLeastPoints) return std::nullopt;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const auto& p : points) mean += p / static_cast<double>(points.size());
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (const auto& p : points) spread += (p - mean) * (p - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
    line = {mean, axes.eigenvectors().col(1)};
    if (line.direction.y() > 0) line.direction = -line.direction;
    const Eigen::Vector2d across = axes.eigenvectors().col(0);
    std::erase_if(points, [&](const auto& p) { return std::abs(across.dot(p - mean)) > 2; });
  }
  return line;
}

bool is_inside(const std::vector<unsigned char>& mask, const trial::GreyImage& image, const Eigen::Vector2d& p) {
  const auto x = static_cast<Eigen::Index>(std::lround(p.x())), y = static_cast<Eigen::Index>(std::lround(p.y()));
  return x >= 0 && y >= 0 && x < image.cols() && y < image.rows() &&
         mask[static_cast<size_t>(y * image.cols() + x)] != 0;
}

// Line of the side edge from its lower end up: the last point two pixels inside of which there is fabric.
Eigen::Vector2d end_of_edge(const Line& line, bool left, const std::vector<unsigned char>& mask,
                            const trial::GreyImage& image, double length_px) {
  constexpr double kStep_px = 0.25;
  const Eigen::Vector2d inwards((left ? 1 : -1) * std::abs(line.direction.y()), 0);
  Eigen::Vector2d last = line.point;
  int outside = 0;
  for (double s = 0; s < length_px && outside < 12; s += kStep_px) {
    const Eigen::Vector2d p = line.point + s * line.direction;
    if (is_inside(mask, image, p + 2 * inwards)) last = p, outside = 0;
    else ++outside;
  }
  return last;
}

std::optional<Eigen::Vector2d> corner_of(const trial::GreyImage& image, const std::vector<unsigned char>& mask,
                                         const std::vector<observe::SilhouettePoint>& outline,
                                         const Eigen::Vector2d& expected, bool left, const CornerOptions& options) {
  std::vector<Eigen::Vector2d> edge;
  for (const observe::SilhouettePoint& p : outline) {
    const double out = left ? -p.normal.x() : p.normal.x();
    const Eigen::Vector2d from = p.pixel - expected;
    if (out > kAcross && std::abs(from.x()) < options.reach_px && from.y() > 0 &&
        from.y() < options.edge_px + options.reach_px)
      edge.push_back(p.pixel);
  }
  if (edge.empty()) return std::nullopt;
  const auto top =
      std::min_element(edge.begin(), edge.end(), [](const auto& a, const auto& b) { return a.y() < b.y(); })->y();
  std::erase_if(edge, [&](const auto& p) { return p.y() > top + options.edge_px; });
  const std::optional<Line> line = fit_line(edge);
  if (!line) return std::nullopt;
  const Eigen::Vector2d corner = end_of_edge(*line, left, mask, image, 3 * options.edge_px);
  if ((corner - expected).norm() > options.reach_px) return std::nullopt;
  return corner;
}

// The device as if its pixels were shifted by so much.
geometry::Projection moved_by(geometry::Projection device, const Eigen::Vector2d& shift_px) {
  device.matrix.row(0) += shift_px.x() * device.matrix.row(2);
  device.matrix.row(1) += shift_px.y() * device.matrix.row(2);
  return device;
}

std::optional<LineMap> line_at(const observe::StripeObservation& seen, const Eigen::Vector2d& at,
                               const CornerOptions& options) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() * 1e-6;
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  int edges = 0;
  for (const observe::StripeEdge& edge : seen.edges) {
    const Eigen::Vector2d d = edge.pixel - at;
    if (!edge.labelled || d.norm() > options.stripe_reach_px) continue;
    const double weight = std::exp(-0.5 * d.squaredNorm() / (options.stripe_weight_px * options.stripe_weight_px));
    const Eigen::Vector3d basis(1, d.x(), d.y());
    normal += weight * basis * basis.transpose();
    right += weight * edge.projector_px * basis;
    ++edges;
  }
  if (edges < kLeastEdges) return std::nullopt;
  const Eigen::Vector3d fit = normal.ldlt().solve(right);
  return LineMap{at, fit[0], fit.tail<2>()};
}

// The labelling counts stripes from a held corner and bears only a share of a period there; a projector that has
// moved further is met by counting from a third of a period to either side as well.
std::optional<LineMap> find_line(const trial::Trial& trial, observe::StripeObservation& seen,
                                 const Eigen::Vector3d& tracked, const Eigen::Vector2d& at,
                                 const CornerOptions& options) {
  const render::StripePattern pattern = observe::pattern_of(*trial.pattern);
  const geometry::Projection camera = moved_by(*trial.camera, at - geometry::project(*trial.camera, tracked));
  const Eigen::Vector2d across = pattern.horizontal ? Eigen::Vector2d::UnitY() : Eigen::Vector2d::UnitX();
  const double expected_px = across.dot(geometry::project(*trial.projector, tracked));
  for (const double share : {0.0, 1.0 / 3, -1.0 / 3}) {
    const double shift_px = share * pattern.period_px;
    observe::label_edges(seen, camera, moved_by(*trial.projector, shift_px * across), pattern, tracked, tracked);
    auto line = line_at(seen, at, options);
    if (!line || std::abs(line->line_px - expected_px - shift_px) > kCornerAgrees * pattern.period_px) continue;
    line->line_px -= pattern.period_px * std::round((line->line_px - expected_px) / pattern.period_px);
    return line;
  }
  return std::nullopt;
}

}  // namespace

HeldCorners find_held_corners(const trial::Trial& trial, const trial::GreyImage& image, const TrackedCorners& tracked,
                              const CornerOptions& options) {
  HeldCorners corners;
  const observe::Background background = observe::measure_background(image);
  const std::vector<unsigned char> mask = observe::silhouette_mask(image, background);
  const auto outline = observe::outline_points(image, mask, background);
  for (size_t side = 0; side < 2; ++side)
    if (tracked[side])
      corners[side].pixel =
          corner_of(image, mask, outline, geometry::project(*trial.camera, *tracked[side]), side == 0, options);
  if (!trial.projector || !trial.pattern) return corners;
  observe::StripeObservation seen =
      observe::observe_stripes(image, *trial.camera, *trial.projector, observe::pattern_of(*trial.pattern));
  for (size_t side = 0; side < 2; ++side)
    if (tracked[side])
      corners[side].line =
          find_line(trial, seen, *tracked[side],
                    corners[side].pixel.value_or(geometry::project(*trial.camera, *tracked[side])), options);
  return corners;
}

std::optional<Eigen::Vector2d> find_corner(const trial::GreyImage& image, const Eigen::Vector2d& expected, bool left,
                                           const CornerOptions& options) {
  const observe::Background background = observe::measure_background(image);
  const std::vector<unsigned char> mask = observe::silhouette_mask(image, background);
  return corner_of(image, mask, observe::outline_points(image, mask, background), expected, left, options);
}

}  // namespace selvedge::station
