#include "cloth/contact/closest.h"

#include <algorithm>
#include <cmath>

namespace selvedge::cloth::contact {

namespace {

using Eigen::Vector3d;

// Barycentric weights of the point of triangle abc next to p.
std::array<double, 3> nearest_on_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const Vector3d bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const Vector3d cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

double largest_norm(const Vector3d& a, const Vector3d& b) {
  return std::sqrt(std::max(a.squaredNorm(), b.squaredNorm()));
}

}  // namespace

SegmentPoints closest_of_segments(const Vector3d& a0, const Vector3d& a1, const Vector3d& b0, const Vector3d& b1) {
  const Vector3d d1 = a1 - a0, d2 = b1 - b0, r = a0 - b0;
  const double a = d1.squaredNorm(), e = d2.squaredNorm(), f = d2.dot(r), c = d1.dot(r), b = d1.dot(d2);
  if (a == 0 || e == 0) {  // a point, as an axis of no length is
    if (e == 0) return {a == 0 ? 0 : std::clamp(-c / a, 0.0, 1.0), 0};
    return {0, std::clamp(f / e, 0.0, 1.0)};
  }
  const double across = a * e - b * b;
  double s = across > 1e-12 * a * e ? std::clamp((b * f - c * e) / across, 0.0, 1.0) : 0.5;
  double t = (b * s + f) / e;
  if (t < 0) {
    t = 0;
    s = std::clamp(-c / a, 0.0, 1.0);
  } else if (t > 1) {
    t = 1;
    s = std::clamp((b - c) / a, 0.0, 1.0);
  }
  return {s, t};
}

Closest closest(Kind kind, const Four& x) {
  Closest out;
  if (kind == Kind::vertex_triangle) {
    const auto b = nearest_on_triangle(x[0], x[1], x[2], x[3]);
    out.weight = {1, -b[0], -b[1], -b[2]};
    out.separation = x[0] - (b[0] * x[1] + b[1] * x[2] + b[2] * x[3]);
  } else {
    const SegmentPoints p = closest_of_segments(x[0], x[1], x[2], x[3]);
    out.weight = {1 - p.first, p.first, p.second - 1, -p.second};
    out.separation = (x[0] + p.first * (x[1] - x[0])) - (x[2] + p.second * (x[3] - x[2]));
  }
  out.distance = out.separation.norm();
  return out;
}

std::optional<double> time_of_approach(Kind kind, const Four& start, const Four& displacement, double distance_m,
                                       double least_m) {
  Four p = displacement, x = start;
  const Vector3d mean = 0.25 * (p[0] + p[1] + p[2] + p[3]);
  for (Vector3d& each : p) each -= mean;
  const double approach = kind == Kind::vertex_triangle ? p[0].norm() + std::max(p[1].norm(), largest_norm(p[2], p[3]))
                                                        : largest_norm(p[0], p[1]) + largest_norm(p[2], p[3]);
  if (approach == 0) return std::nullopt;
  constexpr double kShare = 0.1;  // of the room at the start, at which the pair counts as come down
  double room = distance_m - least_m;
  const double enough = kShare * room;
  double time = 0;
  for (int k = 0; k < 1000; ++k) {
    if (room >= approach * (1 - time)) return std::nullopt;
    time += (1 - kShare) * room / approach;
    for (size_t i = 0; i < 4; ++i) x[i] = start[i] + time * p[i];
    room = closest(kind, x).distance - least_m;
    if (room <= enough) return time;
  }
  return time;
}

}  // namespace selvedge::cloth::contact
