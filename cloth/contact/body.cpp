#include "cloth/contact/body.h"

#include <algorithm>
#include <cmath>

#include "cloth/contact/closest.h"

namespace selvedge::cloth::contact {

BodyContacts::BodyContacts(const Surface& surface, const Body& body) : surface_(surface), body_(body) {
  for (const auto& p : surface.flat)
    for (size_t k = 0; k < 3; ++k) edge_m_ = std::max(edge_m_, (p[(k + 1) % 3] - p[k]).norm());
}

BodyStep BodyContacts::step(double start_s, double step_s) const {
  if (!body_.capsules_at) return {};
  return {body_.capsules_at(start_s), body_.capsules_at(start_s + step_s)};
}

double BodyContacts::displacement(const BodyStep& body, const Eigen::Vector3d& drift_m) {
  double most = drift_m.norm();  // of what stands still
  for (size_t i = 0; i < body.start.size(); ++i)
    most = std::max(most, std::max((body.end[i].from - body.start[i].from - drift_m).norm(),
                                   (body.end[i].to - body.start[i].to - drift_m).norm()) +
                              std::abs(body.end[i].radius_m - body.start[i].radius_m));
  return most;
}

void BodyContacts::rebuild(Hierarchy& tree, const Eigen::Matrix3Xd& position, const BodyStep& body, double thickness_m,
                           double reach_m) {
  items_.clear();
  const double never_yet = -1;
  std::vector<int> triangles;
  for (size_t i = 0; i < body.start.size(); ++i) {
    const Capsule& c = body.start[i];
    triangles.clear();
    tree.near_segment(c.from, c.to, c.radius_m + reach_m, triangles);
    // An edge between two vertices on the surface cuts this deep into it.
    const bool with_edges = edge_m_ * edge_m_ / (8 * c.radius_m) > 0.2 * thickness_m;
    for (const int t : triangles) {
      for (const int v : surface_.owned_vertices[static_cast<size_t>(t)])
        items_.push_back({never_yet, static_cast<int>(i), v, -1});
      if (!with_edges) continue;
      for (const int e : surface_.owned_edges[static_cast<size_t>(t)]) {
        const auto& edge = surface_.edges[static_cast<size_t>(e)];
        items_.push_back({never_yet, static_cast<int>(i), edge[0], edge[1]});
      }
    }
  }
  for (size_t i = 0; i < body_.half_spaces.size(); ++i)
    for (int v = 0; v < surface_.vertex_count; ++v)
      if (body_.half_spaces[i].normal.dot(position.col(v)) - body_.half_spaces[i].offset_m < reach_m)
        items_.push_back({never_yet, static_cast<int>(body.start.size() + i), v, -1});
}

BodyContacts::Touch BodyContacts::touch(const Item& item, const BodyStep& body, double step_s,
                                        const Eigen::Matrix3Xd& position) const {
  const auto index = static_cast<size_t>(item.capsule);
  const Eigen::Vector3d one = position.col(item.one);
  if (index >= body.start.size()) {
    const HalfSpace& h = body_.half_spaces[index - body.start.size()];
    return {h.normal, Eigen::Vector3d::Zero(), h.normal.dot(one) - h.offset_m, 0};
  }
  const Capsule &c = body.start[index], &later = body.end[index];
  const Eigen::Vector3d two = item.two < 0 ? one : Eigen::Vector3d(position.col(item.two));
  const SegmentPoints p = closest_of_segments(one, two, c.from, c.to);
  const Eigen::Vector3d apart = one + p.first * (two - one) - c.from - p.second * (c.to - c.from);
  const double distance = apart.norm();
  const Eigen::Vector3d normal = distance > 0 ? Eigen::Vector3d(apart / distance) : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d moved = (1 - p.second) * (later.from - c.from) + p.second * (later.to - c.to);
  return {normal, (moved + (later.radius_m - c.radius_m) * normal) / step_s, distance - c.radius_m, p.first};
}

void BodyContacts::collide(const Law& law, const BodyStep& body, double step_s, const double* inverse_mass,
                           const Eigen::Matrix3Xd& position, double travel_m, double travel_end_m,
                           Eigen::Matrix3Xd& velocity) {
  constexpr double kWayOut_m_s = 0.3;  // speed at which what has got inside is let out, at most
  for (Item& item : items_) {
    if (item.wake_m > travel_end_m) continue;
    const Touch t = touch(item, body, step_s, position);
    item.wake_m = travel_m + (t.gap_m - law.thickness_m);
    if (t.gap_m >= law.thickness_m && item.wake_m > travel_end_m) continue;
    const bool is_edge = item.two >= 0;
    if (is_edge && (t.share <= 0 || t.share >= 1)) continue;  // its vertices are looked at by themselves
    const double w1 = 1 - t.share, w2 = t.share;
    const double m1 = inverse_mass[item.one], m2 = is_edge ? inverse_mass[item.two] : 0;
    const double of_both = w1 * w1 * m1 + w2 * w2 * m2;
    if (of_both == 0) continue;
    Eigen::Vector3d relative = w1 * velocity.col(item.one) - t.body_velocity;
    if (is_edge) relative += w2 * velocity.col(item.two);
    const double least =
        t.gap_m >= 0 ? least_speed(law, step_s, t.gap_m) : std::min(-0.1 * t.gap_m / step_s, kWayOut_m_s);
    if (t.gap_m >= law.thickness_m && t.normal.dot(relative) >= least) continue;
    const Eigen::Vector3d impulse = impulse_of(law, step_s, t.gap_m, t.normal, relative, of_both, least);
    velocity.col(item.one) += w1 * m1 * impulse;
    if (is_edge) velocity.col(item.two) += w2 * m2 * impulse;
  }
}

}  // namespace selvedge::cloth::contact
