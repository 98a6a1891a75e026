#include "cloth/guide.h"

#include <algorithm>
#include <cmath>

namespace selvedge::cloth {

using Eigen::Index;
using Eigen::Vector3d;

namespace {

constexpr double kDamping = 0.7;  // of critical

Vector3d at_point(const SurfacePoint& point, const double* values) {
  Vector3d sum = Vector3d::Zero();
  for (size_t k = 0; k < point.vertices.size(); ++k)
    sum += point.weights[k] * Eigen::Map<const Vector3d>(values + 3 * point.vertices[k]);
  return sum;
}

}  // namespace

GuideTrack::Seen GuideTrack::at(double t_s) const {
  const auto count = static_cast<Index>(points.size()), times = static_cast<Index>(time_s.size());
  Seen seen{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd::Zero(3, count)};
  const auto take_normals = [&](Index j) {
    if (normal.cols() > 0) seen.normal = normal(Eigen::all, Eigen::seqN(j, count, times));
  };
  const auto above = std::upper_bound(time_s.begin(), time_s.end(), t_s);
  if (above == time_s.begin() || above == time_s.end()) {
    const Index j = above == time_s.begin() ? 0 : times - 1;
    seen.position = position(Eigen::all, Eigen::seqN(j, count, times));
    take_normals(j);
    return seen;
  }
  const Index j = above - time_s.begin() - 1;
  const double from = time_s[static_cast<size_t>(j)], step = time_s[static_cast<size_t>(j + 1)] - from,
               x = (t_s - from) / step;
  take_normals(x < 0.5 ? j : j + 1);
  for (Index k = 0; k < count; ++k) {
    const auto p = [&](Index i) { return Vector3d(position.col(k * times + std::clamp<Index>(i, 0, times - 1))); };
    const Vector3d p0 = p(j - 1), p1 = p(j), p2 = p(j + 1), p3 = p(j + 2);
    const Vector3d a = 0.5 * (p2 - p0), b = 0.5 * (2 * p0 - 5 * p1 + 4 * p2 - p3),
                   c = 0.5 * (3 * p1 - p0 - 3 * p2 + p3);
    seen.position.col(k) = p1 + x * (a + x * (b + x * c));
    seen.velocity.col(k) = (a + x * (2 * b + 3 * x * c)) / step;
  }
  return seen;
}

bool LetGo::is_free(double since_start_s) const {
  if (free_s <= 0 || since_start_s < held_s) return false;
  const double turns = (since_start_s - held_s - first_s) / (2 * free_s);
  return turns - std::floor(turns) < 0.5;
}

void add_nudging(const Guide& guide, double mass_kg, double t_s, const double* position, const double* velocity,
                 double* force) {
  const GuideTrack& track = *guide.track;
  const GuideTrack::Seen seen = track.at(guide.stamp_of ? guide.stamp_of(t_s) : t_s);
  const double each = mass_kg / static_cast<double>(track.points.size());
  const double stiffness = each * guide.nudging_per_s * guide.nudging_per_s,
               damping = 2 * kDamping * each * guide.nudging_per_s;
  for (size_t k = 0; k < track.points.size(); ++k) {
    const SurfacePoint& point = track.points[k];
    const auto column = static_cast<Index>(k);
    Vector3d nudge = stiffness * (seen.position.col(column) - at_point(point, position));
    if (velocity) nudge += damping * (seen.velocity.col(column) - at_point(point, velocity));
    if (seen.normal.cols() > 0) nudge = Vector3d(seen.normal.col(column)) * nudge.dot(seen.normal.col(column));
    if (!nudge.allFinite()) continue;
    for (size_t i = 0; i < point.vertices.size(); ++i)
      Eigen::Map<Vector3d>(force + 3 * point.vertices[i]) += point.weights[i] * nudge;
  }
}

kernel::StepFilter guided(std::shared_ptr<const Guide> guide, kernel::StepFilter after) {
  return [guide = std::move(guide), after = std::move(after),
          force = std::vector<double>()](const kernel::Step& step) mutable {
    if (!guide->let_go.is_free(step.start_s - guide->start_s)) {
      const size_t n = step.vertex_count;
      double mass = 0;
      for (size_t v = 0; v < n; ++v) mass += step.inverse_mass[v] > 0 ? 1 / step.inverse_mass[v] : 0;
      force.assign(3 * n, 0);
      add_nudging(*guide, mass, step.start_s, step.before, step.velocity, force.data());
      for (size_t i = 0; i < 3 * n; ++i) {
        const double change = step.since_s * step.inverse_mass[i / 3] * force[i];
        step.velocity[i] += change;
        step.after[i] += step.step_s * change;
      }
    }
    if (after) after(step);
  };
}

}  // namespace selvedge::cloth
