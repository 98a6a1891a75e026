#include "cloth/contact/pairs.h"

#include <algorithm>

namespace selvedge::cloth::contact {

namespace {

Box box_of(const Eigen::Matrix3Xd& x, const int* vertices, int count) {
  Box box{x.col(vertices[0]), x.col(vertices[0])};
  for (int i = 1; i < count; ++i) {
    box.low = box.low.cwiseMin(x.col(vertices[i]));
    box.high = box.high.cwiseMax(x.col(vertices[i]));
  }
  return box;
}

}  // namespace

void PairList::add(Kind kind, const std::array<int, 4>& vertex, const Eigen::Matrix3Xd& position, double reach_m, double travel_m) {
  const int first = kind == Kind::vertex_triangle ? 1 : 2;
  if (!within_reach(box_of(position, vertex.data(), first), box_of(position, vertex.data() + first, 4 - first), reach_m)) return;
  const double distance = closest(kind, columns(position, vertex)).distance;
  if (distance < reach_m) pairs_.push_back({travel_m, vertex, kind});
}

void PairList::add_features(int one, int two, const Eigen::Matrix3Xd& position, double reach_m, double travel_m) {
  const auto a = static_cast<size_t>(one), b = static_cast<size_t>(two);
  const auto vertices_against = [&](size_t owner, size_t other) {
    const auto& t = surface_.triangles[other];
    for (const int v : surface_.owned_vertices[owner])
      if (v != t[0] && v != t[1] && v != t[2]) add(Kind::vertex_triangle, {v, t[0], t[1], t[2]}, position, reach_m, travel_m);
  };
  vertices_against(a, b);
  vertices_against(b, a);
  for (const int i : surface_.owned_edges[a])
    for (const int j : surface_.owned_edges[b]) {
      const auto &e = surface_.edges[static_cast<size_t>(i)], &f = surface_.edges[static_cast<size_t>(j)];
      if (e[0] != f[0] && e[0] != f[1] && e[1] != f[0] && e[1] != f[1])
        add(Kind::edge_edge, {e[0], e[1], f[0], f[1]}, position, reach_m, travel_m);
    }
}

void PairList::rebuild(Hierarchy& tree, const Eigen::Matrix3Xd& position, double reach_m, double travel_m) {
  pairs_.clear();
  triangles_.clear();
  tree.near_itself(reach_m, triangles_);
  for (const auto& [one, two] : triangles_) add_features(one, two, position, reach_m, travel_m);
}

void PairList::collect(const Eigen::Matrix3Xd& position, double thickness_m, double travel_m, double travel_end_m,
                       std::vector<NearPair>& near) {
  near.clear();
  for (Pair& pair : pairs_) {
    if (pair.wake_m > travel_end_m) continue;
    const Closest at = closest(pair.kind, columns(position, pair.vertex));
    pair.wake_m = travel_m + (at.distance - thickness_m) / 2;
    if (pair.wake_m <= travel_end_m) near.push_back({pair.kind, pair.vertex, at});
  }
}

}  // namespace selvedge::cloth::contact
