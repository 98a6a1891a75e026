#include "model/seen_markers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include <Eigen/Geometry>

#include "geometry/cubic.h"
#include "geometry/order_statistics.h"
#include "model/held_markers.h"

namespace selvedge::model {

using cloth::SurfacePoint;
using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

namespace {

// The two samples around a time and two more, for a cubic; clamped at the ends.
struct Between {
  size_t before = 0;
  double share = 0;
};

Between between(const std::vector<double>& sample_s, double t) {
  if (sample_s.size() < 2) return {};
  const double step = sample_s[1] - sample_s[0];
  const double at = std::clamp((t - sample_s[0]) / step, 0.0, static_cast<double>(sample_s.size() - 1) - 1e-9);
  return {static_cast<size_t>(at), at - std::floor(at)};
}

template <class Pick>
auto interpolated(const Between& b, size_t count, const Pick& pick) {
  const auto clamped = [&](std::ptrdiff_t i) {
    return pick(static_cast<size_t>(std::clamp<std::ptrdiff_t>(i, 0, static_cast<std::ptrdiff_t>(count) - 1)));
  };
  const auto i = static_cast<std::ptrdiff_t>(b.before);
  return geometry::catmull_rom(b.share, clamped(i - 1), clamped(i), clamped(i + 1), clamped(i + 2));
}

Index column_of(const observe::MarkerTrack& track, size_t marker, size_t time) {
  return static_cast<Index>(marker * track.time_s.size() + time);
}

// Where the outline lies inside the edge, the markers of its grid lie as far inside.
std::vector<SurfacePoint> points_inside(const cloth::spline::SplineSheet& sheet, const ObservedTrial& trial,
                                        double erosion_m) {
  std::vector<SurfacePoint> out;
  const Eigen::Vector2d size(trial.width_m, trial.height_m);
  for (const Eigen::Vector2d& uv : trial.markers->uv) {
    const Eigen::Vector2d share = (1 - 2 * erosion_m / size.array()).max(0.0);
    out.push_back(
        surface_point(sheet, (share.array() * uv.array() + 0.5 * (1 - share.array()) * size.array()).matrix()));
  }
  return out;
}

// Points of the sheet over a smoothing in time: a Gaussian's mean by five nodes (Gauss and Hermite).
Vector3d smoothed_at(const Prediction& p, const cloth::Trajectory& trajectory, const SurfacePoint& point, double t_s) {
  const auto at = [&](double t) {
    return interpolated(between(p.experiment.sample_s, t), trajectory.samples.size(),
                        [&](size_t i) -> Vector3d { return position_of(point, trajectory.samples[i]); });
  };
  if (p.sensor.smoothing_s2 <= 0) return at(t_s);
  constexpr std::array<double, 3> kNodes = {0, 1.355626179974266, 2.856970013872806},
                                  kWeights = {0.5333333333333333, 0.2220759220056126, 0.0112574113277207};
  Vector3d sum = kWeights[0] * at(t_s);
  const double sd_s = std::sqrt(p.sensor.smoothing_s2);
  for (size_t k = 1; k < kNodes.size(); ++k)
    sum += kWeights[k] * (at(t_s - kNodes[k] * sd_s) + at(t_s + kNodes[k] * sd_s));
  return sum;
}

// Lines of a grid's markers, in order: all rows and all columns of three or more.
std::vector<std::vector<size_t>> lines_of(const std::vector<Eigen::Vector2d>& uv) {
  std::vector<std::vector<size_t>> out;
  for (const int along : {0, 1}) {
    std::map<long, std::vector<size_t>> lines;  // by the other coordinate, mm
    for (size_t k = 0; k < uv.size(); ++k) lines[std::lround(1e3 * uv[k](1 - along))].push_back(k);
    for (auto& [place, line] : lines) {
      if (line.size() < 3) continue;
      std::sort(line.begin(), line.end(), [&](size_t a, size_t b) { return uv[a](along) < uv[b](along); });
      out.push_back(line);
    }
  }
  return out;
}

// From each marker of a line to where it would be seen if the line's markers were spaced along the line's chord as they
// are on the flat fabric.
std::vector<Vector3d> drift_along(const std::vector<Vector3d>& line, const std::vector<double>& share) {
  const Vector3d chord = line.back() - line.front();
  std::vector<Vector3d> out(line.size(), Vector3d::Zero());
  const double square = chord.squaredNorm();
  if (square <= 0) return out;
  std::vector<double> along;
  for (const Vector3d& x : line) along.push_back((x - line.front()).dot(chord) / square);
  for (size_t i = 1; i + 1 < line.size(); ++i) {
    size_t k = 1;
    while (k + 1 < line.size() && along[k] < share[i]) ++k;
    const double step = along[k] - along[k - 1];
    if (!(step > 0)) continue;
    out[i] = line[k - 1] + (share[i] - along[k - 1]) / step * (line[k] - line[k - 1]) - line[i];
  }
  return out;
}

void drift(const observe::MarkerTrack& track, double share, Matrix3Xd& seen) {
  const std::vector<std::vector<size_t>> lines = lines_of(track.uv);
  const Matrix3Xd before = seen;
  for (size_t j = 0; j < track.time_s.size(); ++j)
    for (const std::vector<size_t>& line : lines) {
      std::vector<Vector3d> points;
      std::vector<double> even;
      const Eigen::Vector2d first = track.uv[line.front()], whole = track.uv[line.back()] - first;
      for (const size_t k : line) {
        points.emplace_back(before.col(column_of(track, k, j)));
        even.push_back((track.uv[k] - first).dot(whole) / whole.squaredNorm());
      }
      const std::vector<Vector3d> by = drift_along(points, even);
      for (size_t i = 0; i < line.size(); ++i) seen.col(column_of(track, line[i], j)) += share * by[i];
    }
}

// Of a point at x: how much further the tracker has it, by depth and by pose.
Vector3d pose_shift(const ObservedTrial& trial, const observe::SensorModel& s, const Vector3d& x) {
  Vector3d shift = s.turn_rad.cross(x) + s.shift_m;
  if (trial.camera_centre && s.depth_bias != 0) shift += s.depth_bias * (x - *trial.camera_centre);
  return shift;
}

bool has_pose(const observe::SensorModel& s) {
  return !s.turn_rad.isZero(0) || !s.shift_m.isZero(0) || s.depth_bias != 0;
}

// A held outline's jumps, spread to all markers: they fall to nothing at the edge opposite to the held one.
Matrix3Xd jitter(const ObservedTrial& trial, const Prediction& p) {
  const observe::MarkerTrack& track = *trial.markers;
  Matrix3Xd out = Matrix3Xd::Zero(3, track.position.cols());
  const Jumps jumps(trial, p.experiment.path);
  if (jumps.empty()) return out;
  for (size_t k = 0; k < track.uv.size(); ++k) {
    const double along = track.uv[k].x() / trial.width_m, falls = 1 - track.uv[k].y() / trial.height_m;
    for (size_t j = 0; j < track.time_s.size(); ++j)
      out.col(column_of(track, k, j)) = p.sensor.outline_jitter * falls * jumps.of(j, k, along);
  }
  return out;
}

constexpr double kCubic_s = 0.21;  // a cubic follows a swing for so long

// Cubic through two samples before and two after, at uneven times (Lagrange).
std::optional<Vector3d> between_neighbours(const std::vector<double>& time_s, size_t at, const Matrix3Xd& x) {
  if (at < 2 || at + 2 >= time_s.size()) return std::nullopt;
  if (time_s[at + 2] - time_s[at - 2] > kCubic_s) return std::nullopt;
  const std::array<size_t, 4> near = {at - 2, at - 1, at + 1, at + 2};
  Vector3d sum = Vector3d::Zero();
  for (const size_t i : near) {
    double weight = 1;
    for (const size_t other : near)
      if (other != i) weight *= (time_s[at] - time_s[other]) / (time_s[i] - time_s[other]);
    sum += weight * x.col(static_cast<Index>(i));
  }
  if (!sum.allFinite()) return std::nullopt;
  return sum;
}

constexpr double kDeviations = 3;           // Huber's
constexpr double kLeastDeviation_m = 1e-3;  // less pushes a hold of 20/s with an eighth of gravity at most

// One pass over all markers: x is what was seen, or within three deviations of its neighbours as they are by now. Of
// neighbours the furthest alone is moved: beside one that jumps, those that do not seem to.
void gate_once(const observe::MarkerTrack& track, const Matrix3Xd& seen, Matrix3Xd& x) {
  const auto times = static_cast<Index>(track.time_s.size());
  Matrix3Xd off = Matrix3Xd::Constant(3, seen.cols(), std::nan(""));
  std::vector<double> sizes;
  for (size_t k = 0; k < track.uv.size(); ++k) {
    const Matrix3Xd own = x.middleCols(static_cast<Index>(k) * times, times);
    for (size_t j = 0; j < track.time_s.size(); ++j) {
      const Index c = column_of(track, k, j);
      const std::optional<Vector3d> expected = between_neighbours(track.time_s, j, own);
      if (!expected || !seen.col(c).allFinite()) continue;
      off.col(c) = seen.col(c) - *expected;
      sizes.push_back(off.col(c).norm());
    }
  }
  if (sizes.empty()) return;
  constexpr double kMedianOfNorm = 1.538;  // of three Gaussian numbers of deviation 1
  const double most = kDeviations * std::max(geometry::median(std::move(sizes)) / kMedianOfNorm, kLeastDeviation_m);
  x = seen;
  for (Index c = 0; c < seen.cols(); ++c) {
    const double size = off.col(c).norm();
    if (!(size > most)) continue;
    bool furthest = true;
    const Index first = c - c % times;
    for (Index other = std::max(first, c - 2); other <= std::min(first + times - 1, c + 2); ++other)
      furthest = furthest && !(off.col(other).norm() > size);
    if (furthest) x.col(c) -= (1 - most / size) * off.col(c);
  }
}

void hold_back_jumps(const ObservedTrial& trial, const cloth::HeldPath& path, Matrix3Xd& position) {
  const observe::MarkerTrack& track = *trial.markers;
  Matrix3Xd held(3, position.cols());
  for (size_t j = 0; j < track.time_s.size(); ++j) {
    const Eigen::Matrix<double, 3, 2> ends = path.at(track.time_s[j]);
    for (size_t k = 0; k < track.uv.size(); ++k) {
      const double along = track.uv[k].x() / trial.width_m;
      held.col(column_of(track, k, j)) = ends * Eigen::Vector2d(1 - along, along);
    }
  }
  const Matrix3Xd seen = position - held;
  Matrix3Xd x = seen;
  constexpr int kPasses = 4;
  for (int pass = 0; pass < kPasses; ++pass) gate_once(track, seen, x);
  position += x - seen;
}

}  // namespace

observe::StampDrift stamp_drift(const ObservedTrial& trial, const Prediction& p) {
  observe::StampDrift out{p.sensor.drift, trial.recorded_from_s, {}, trial.lost_each_s};
  if (trial.markers) out.lost = trial.markers->lost;
  return out;
}

std::function<double(double)> stamps_of(const ObservedTrial& trial, const Prediction& p) {
  if (p.sensor.drift == 0) return {};
  return [stamps = stamp_drift(trial, p)](double t_s) { return stamps.stamp_of(t_s); };
}

Matrix3Xd position_at(const cloth::Experiment& e, const cloth::Trajectory& trajectory, double t_s) {
  return interpolated(between(e.sample_s, t_s), trajectory.samples.size(),
                      [&](size_t i) -> const Matrix3Xd& { return trajectory.samples[i]; });
}

Matrix3Xd seen_markers(const cloth::spline::SplineSheet& sheet, const ObservedTrial& trial,
                       const std::vector<SurfacePoint>& points, const Prediction& p,
                       const cloth::Trajectory& trajectory) {
  const observe::MarkerTrack& track = *trial.markers;
  const observe::SensorModel& s = p.sensor;
  const std::vector<SurfacePoint> shown =
      s.outline_erosion_m != 0 ? points_inside(sheet, trial, s.outline_erosion_m) : points;
  const observe::StampDrift stamps = stamp_drift(trial, p);
  Matrix3Xd seen(3, static_cast<Index>(track.uv.size() * track.time_s.size()));
  for (size_t k = 0; k < track.uv.size(); ++k)
    for (size_t j = 0; j < track.time_s.size(); ++j)
      seen.col(column_of(track, k, j)) = smoothed_at(p, trajectory, shown[k], stamps.shown_at(track.time_s[j]));
  if (s.grid_drift != 0) drift(track, s.grid_drift, seen);
  if (has_pose(s))
    for (Index c = 0; c < seen.cols(); ++c) seen.col(c) += pose_shift(trial, s, seen.col(c));
  if (s.outline_jitter != 0) seen += jitter(trial, p);
  return seen;
}

std::shared_ptr<const cloth::GuideTrack> guide_track(const cloth::spline::SplineSheet& sheet,
                                                     const ObservedTrial& trial,
                                                     const std::vector<SurfacePoint>& points, const Prediction& p) {
  const observe::MarkerTrack& track = *trial.markers;
  Matrix3Xd position = track.position;
  if (p.sensor.outline_jitter != 0) position -= jitter(trial, p);
  if (has_pose(p.sensor))
    for (Index c = 0; c < position.cols(); ++c) position.col(c) -= pose_shift(trial, p.sensor, position.col(c));
  hold_back_jumps(trial, p.experiment.path, position);
  const double erosion_m = p.sensor.outline_erosion_m;
  return std::make_shared<cloth::GuideTrack>(cloth::GuideTrack{
      erosion_m != 0 ? points_inside(sheet, trial, erosion_m) : points, track.time_s, std::move(position), {}});
}

}  // namespace selvedge::model
