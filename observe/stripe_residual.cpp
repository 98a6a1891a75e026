#include "observe/stripe_residual.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Geometry>

#include "files/bad_input.h"
#include "geometry/order_statistics.h"
#include "observe/kept_frames.h"
#include "render/row_map.h"

namespace selvedge::observe {

namespace {

constexpr size_t kDepthPointsAFrame = 700;
constexpr size_t kOutlinePointsAFrame = 160;

double median_depth(const std::vector<DepthPoint>& points) {
  std::vector<double> depth;
  for (const DepthPoint& p : points) depth.push_back(p.depth_m);
  return depth.empty() ? 1 : geometry::median(std::move(depth));
}

StripeFrame track_frame(const trial::Trial& trial, size_t index, const StripeTrack& o, double focal_px) {
  const trial::Frames& frames = *trial.frames;
  StripeFrame out;
  out.index = index;
  out.time_s = frames.time_s[index];
  out.number = frames.number[index];
  StripeObservation seen = observe_stripes(trial::read_frame(trial, index), o.camera, o.projector, o.pattern);
  const auto corner = std::lower_bound(trial.corners.time_s.begin(), trial.corners.time_s.end(), out.time_s - 1e-6);
  auto k = std::min<Eigen::Index>(corner - trial.corners.time_s.begin(), trial.corners.left.cols() - 1);
  while (k > 0 && !(trial.corners.left.col(k).allFinite() && trial.corners.right.col(k).allFinite())) --k;
  label_edges(seen, o.camera, o.projector, o.pattern, trial.corners.left.col(k), trial.corners.right.col(k));
  out.depth = every_nth(depth_points(seen, o.camera, o.projector, o.pattern), kDepthPointsAFrame);
  const double mm_per_px = 1e3 * median_depth(out.depth) / focal_px;
  std::vector<OutlinePoint> outline;
  for (const SilhouettePoint& p : seen.silhouette)
    outline.push_back({p.pixel, p.normal, mm_per_px, std::max(p.sd_px, 0.3) * mm_per_px});
  out.outline = every_nth(outline, kOutlinePointsAFrame);
  return out;
}

// Of each square of a picture the point that is nearest to its middle: a fabric's rim throws others off.
template <class T>
void mark_one_a_square(const std::vector<T>& points, double side_px, std::vector<bool>& out) {
  std::map<std::pair<long, long>, std::pair<double, size_t>> nearest;
  const size_t first = out.size();
  out.resize(first + points.size(), false);
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d at = points[i].pixel / side_px, square = at.array().floor();
    const std::pair<double, size_t> here = {(at - square - Eigen::Vector2d(0.5, 0.5)).norm(), first + i};
    const auto place = nearest.try_emplace({static_cast<long>(square.x()), static_cast<long>(square.y())}, here).first;
    place->second = std::min(place->second, here);
  }
  for (const auto& [square, point] : nearest) out[point.second] = true;
}

Eigen::Vector2d nearest_on(const std::vector<Eigen::Vector2d>& line, const Eigen::Vector2d& p) {
  Eigen::Vector2d best = line.front();
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i + 1 < line.size(); ++i) {
    const Eigen::Vector2d side = line[i + 1] - line[i];
    const double share = std::clamp((p - line[i]).dot(side) / std::max(side.squaredNorm(), 1e-12), 0.0, 1.0);
    const Eigen::Vector2d at = line[i] + share * side;
    if ((at - p).squaredNorm() < least) {
      least = (at - p).squaredNorm();
      best = at;
    }
  }
  return best;
}

geometry::Projection distorted(const StripeTrack& track, const SensorModel& sensor) {
  geometry::Projection camera = track.camera;
  if (!track.of_cloud) camera.distortion[0] += sensor.radial_distortion;
  return camera;
}

// Where a camera that stands otherwise than was calibrated sees a shape.
Eigen::Matrix3Xd posed(Eigen::Matrix3Xd shape, const SensorModel& sensor) {
  if (sensor.turn_rad.isZero(0) && sensor.shift_m.isZero(0)) return shape;
  for (Eigen::Index i = 0; i < shape.cols(); ++i)
    shape.col(i) += sensor.turn_rad.cross(Eigen::Vector3d(shape.col(i))) + sensor.shift_m;
  return shape;
}

// camera, position: as the sensor has them.
std::vector<SurfaceHit> hits_on(const StripeTrack& track, const StripeFrame& frame,
                                const std::vector<std::array<int, 3>>& triangles, const SensorModel& sensor,
                                const geometry::Projection& camera, const Eigen::Matrix3Xd& position) {
  render::RowMap map(camera, track.projector);
  map.rasterise(position, triangles);
  // A moved projector or another lens puts the seen point elsewhere on its ray.
  const bool moved = !track.of_cloud && (sensor.radial_distortion != 0 || !sensor.projector_shift_m.isZero(0));
  geometry::Projection projector = track.projector;
  projector.matrix.col(3) -= projector.matrix.leftCols<3>() * sensor.projector_shift_m;
  std::vector<SurfaceHit> out(frame.depth.size());
  for (size_t k = 0; k < out.size(); ++k) {
    const DepthPoint& p = frame.depth[k];
    const auto sample = map.at(p.pixel);
    if (!sample) continue;
    double depth_m = p.depth_m;
    if (moved)
      if (const auto at = triangulate(camera, projector, track.pattern, p.pixel, p.projector_px))
        depth_m = geometry::depth(camera, *at);
    out[k] = {sample->triangle, sample->weights,
              ((1 + sensor.depth_bias) * sample->depth_m - depth_m) * p.ray_m_per_depth_m};
  }
  return out;
}

// How far beside the simulated fabric a point was seen.
double beside_mm(const geometry::Projection& camera, const DepthPoint& p, const std::vector<Eigen::Vector2d>& outline) {
  const Eigen::Vector3d pixel = geometry::ray(camera, p.pixel + Eigen::Vector2d(1, 0)) - geometry::ray(camera, p.pixel);
  const double mm_per_px = 1e3 * p.depth_m * p.ray_m_per_depth_m * pixel.norm();
  return std::min(mm_per_px * (nearest_on(outline, p.pixel) - p.pixel).norm(), kMostBesideMm);
}

}  // namespace

render::StripePattern pattern_of(const trial::StripePattern& recorded) {
  return {recorded.orientation == "horizontal", recorded.period_px, recorded.duty, recorded.first_bright_row_px};
}

void require_optics(const trial::Trial& trial) {
  if (trial.camera && trial.projector && trial.pattern) return;
  refuse((trial.folder / "trial.json").string(),
         "the trial has frames, but no {}; expected camera, projector and projector.pattern",
         !trial.camera      ? "camera"
         : !trial.projector ? "projector"
                            : "projector.pattern");
}

Eigen::Vector3d place_of(const geometry::Projection& camera, const DepthPoint& p) {
  return geometry::centre(camera) + p.depth_m * p.ray_m_per_depth_m * geometry::ray(camera, p.pixel);
}

std::vector<DepthPoint> depth_points(const StripeObservation& seen, const geometry::Projection& camera,
                                     const geometry::Projection& projector, const render::StripePattern& pattern) {
  constexpr double kShift_px = 0.1;
  const Eigen::Vector2d shift = seen.scans_columns ? Eigen::Vector2d(0, kShift_px) : Eigen::Vector2d(kShift_px, 0);
  const Eigen::Vector3d centre = geometry::centre(camera);
  std::vector<DepthPoint> points;
  for (const StripeEdge& edge : seen.edges) {
    if (!edge.labelled) continue;
    const auto at = triangulate(camera, projector, pattern, edge.pixel, edge.projector_px);
    // What a shift by the edge's deviation, along the axis that it was sought on, does to the triangulated point.
    const auto shifted = triangulate(camera, projector, pattern, edge.pixel + shift, edge.projector_px);
    if (!at || !shifted) continue;
    DepthPoint p;
    p.pixel = edge.pixel;
    p.projector_px = edge.projector_px;
    p.depth_m = geometry::depth(camera, *at);
    p.ray_m_per_depth_m = (*at - centre).norm() / p.depth_m;
    const double along_ray_m = std::abs(geometry::depth(camera, *shifted) - p.depth_m) * p.ray_m_per_depth_m;
    p.sd_mm = std::max(1e3 * along_ray_m * edge.sd_px / kShift_px, 0.05);
    points.push_back(p);
  }
  return points;
}

std::shared_ptr<const StripeTrack> track_stripes(const trial::Trial& trial, const ObserveOptions& options, bool still) {
  require_optics(trial);
  auto track = std::make_shared<StripeTrack>();
  track->camera = *trial.camera;
  track->projector = *trial.projector;
  track->pattern = pattern_of(*trial.pattern);
  const double focal_px = geometry::decompose(*trial.camera).intrinsics(0, 0);
  size_t labelled = 0;
  for (const size_t i : kept_frames(trial.frames->time_s, options, still)) {
    track->frames.push_back(track_frame(trial, i, *track, focal_px));
    labelled += track->frames.back().depth.size();
  }
  if (labelled == 0)
    refuse((trial.folder / "frames").string(),
           "no projected stripe could be followed from the held corners in any frame; expected stripes as trial.json "
           "describes them");
  return track;
}

std::vector<bool> one_a_square(const StripeTrack& track, double side_m) {
  const double focal_px = geometry::decompose(track.camera).intrinsics(0, 0);
  std::vector<bool> out;
  for (const StripeFrame& frame : track.frames) {
    const double side_px = side_m * focal_px / median_depth(frame.depth);
    mark_one_a_square(frame.depth, side_px, out);
    mark_one_a_square(frame.outline, side_px, out);
  }
  return out;
}

double last_time_s(const StripeTrack& track) { return track.frames.empty() ? 0 : track.frames.back().time_s; }

std::vector<int> rim_of(const geometry::TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> sides;
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const int a = t[static_cast<size_t>(k)], b = t[static_cast<size_t>((k + 1) % 3)];
      ++sides[{std::min(a, b), std::max(a, b)}];
    }
  std::map<int, std::vector<int>> next;
  for (const auto& [side, count] : sides)
    if (count == 1) {
      next[side.first].push_back(side.second);
      next[side.second].push_back(side.first);
    }
  std::vector<int> rim = {next.begin()->first};
  int before = -1;
  while (rim.size() <= next.size()) {
    const auto& two = next[rim.back()];
    const int to = two[0] == before ? two[1] : two[0];
    before = rim.back();
    rim.push_back(to);
    if (to == rim.front()) break;
  }
  return rim;
}

std::vector<SurfaceHit> surface_hits(const StripeTrack& track, const StripeFrame& frame,
                                     const geometry::TriangleMesh& mesh, const Eigen::Matrix3Xd& shape,
                                     const SensorModel& sensor) {
  return hits_on(track, frame, mesh.triangles, sensor, distorted(track, sensor), posed(shape, sensor));
}

void stripe_residuals(const StripeTrack& track, const StripeFrame& frame, const geometry::TriangleMesh& mesh,
                      const std::vector<int>& rim, const Eigen::Matrix3Xd& shape, const SensorModel& sensor,
                      double* residual_mm) {
  const geometry::Projection camera = distorted(track, sensor);
  const Eigen::Matrix3Xd position = posed(shape, sensor);
  std::vector<Eigen::Vector2d> outline;
  for (const int v : rim) outline.push_back(geometry::project(camera, position.col(v)));
  const std::vector<SurfaceHit> hits = hits_on(track, frame, mesh.triangles, sensor, camera, position);
  for (size_t i = 0; i < hits.size(); ++i)
    *residual_mm++ = hits[i].triangle < 0 ? beside_mm(track.camera, frame.depth[i], outline)
                                          : std::clamp(1e3 * hits[i].off_m, -50.0, 50.0);
  for (const OutlinePoint& p : frame.outline)
    *residual_mm++ = std::clamp(
        (nearest_on(outline, p.pixel) - p.pixel).dot(p.normal) * p.mm_per_px - 1e3 * sensor.outline_erosion_m, -50.0,
        50.0);
}

}  // namespace selvedge::observe
