#include "cloth/contact/pairs.h"

#include <algorithm>

#include <tbb/parallel_for.h>

namespace selvedge::cloth::contact {

namespace {

template <size_t Count>
Box box_of(const Eigen::Matrix3Xd& x, const std::array<int, Count>& vertices) {
  Box box{x.col(vertices[0]), x.col(vertices[0])};
  for (size_t i = 1; i < Count; ++i) {
    box.low = box.low.cwiseMin(x.col(vertices[i]));
    box.high = box.high.cwiseMax(x.col(vertices[i]));
  }
  return box;
}

template <size_t Count>
bool share_a_vertex(const std::array<int, 2>& edge, const std::array<int, Count>& other) {
  return std::any_of(other.begin(), other.end(), [&](int v) { return v == edge[0] || v == edge[1]; });
}

}  // namespace

// Of the features that two triangles own, those within reach. Adds to found.
void PairList::add_features(int one, int two, const Eigen::Matrix3Xd& position, double reach_m, double travel_m,
                            std::vector<Pair>& found) const {
  const auto a = static_cast<size_t>(one), b = static_cast<size_t>(two);
  const auto add_if_near = [&](Kind kind, const std::array<int, 4>& vertex) {
    if (closest(kind, columns(position, vertex)).distance < reach_m) found.push_back({travel_m, vertex, kind});
  };
  const auto vertices_against = [&](size_t owner, size_t other) {
    if (surface_.owned_vertices[owner].empty()) return;
    const auto& t = surface_.triangles[other];
    const Box box = box_of(position, t);
    for (const int v : surface_.owned_vertices[owner])
      if (v != t[0] && v != t[1] && v != t[2] && within_reach({position.col(v), position.col(v)}, box, reach_m))
        add_if_near(Kind::vertex_triangle, {v, t[0], t[1], t[2]});
  };
  vertices_against(a, b);
  vertices_against(b, a);
  if (surface_.owned_edges[b].empty()) return;
  const Box other = box_of(position, surface_.triangles[b]);
  for (const int i : surface_.owned_edges[a]) {
    const auto& e = surface_.edges[static_cast<size_t>(i)];
    const Box box = box_of(position, e);
    if (!within_reach(box, other, reach_m)) continue;
    for (const int j : surface_.owned_edges[b]) {
      const auto& f = surface_.edges[static_cast<size_t>(j)];
      if (!share_a_vertex(e, f) && within_reach(box, box_of(position, f), reach_m))
        add_if_near(Kind::edge_edge, {e[0], e[1], f[0], f[1]});
    }
  }
}

void PairList::rebuild(Hierarchy& tree, const Eigen::Matrix3Xd& position, double reach_m, double travel_m) {
  pairs_.clear();
  triangles_.clear();
  tree.near_itself(reach_m, triangles_);
  // In parts of a fixed size, joined in their order: the list is the same on any number of cores.
  constexpr size_t kPart = 2048;
  parts_.resize((triangles_.size() + kPart - 1) / kPart);
  tbb::parallel_for(size_t{0}, parts_.size(), [&](size_t part) {
    parts_[part].clear();
    const size_t end = std::min(triangles_.size(), (part + 1) * kPart);
    for (size_t k = part * kPart; k < end; ++k)
      add_features(triangles_[k][0], triangles_[k][1], position, reach_m, travel_m, parts_[part]);
  });
  for (const std::vector<Pair>& part : parts_) pairs_.insert(pairs_.end(), part.begin(), part.end());
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
