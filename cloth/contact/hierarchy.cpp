#include "cloth/contact/hierarchy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/LU>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace selvedge::cloth::contact {

namespace {

constexpr int kLeafTriangles = 4;
constexpr double kConvexShare = 0.9;  // of its convex hull that a region must fill

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// Andrew's monotone chain.
double hull_area(std::vector<Eigen::Vector2d> points) {
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  double twice = 0;
  for (int side = 0; side < 2; ++side) {
    std::vector<Eigen::Vector2d> chain;
    for (const Eigen::Vector2d& p : points) {
      while (chain.size() > 1 && cross(chain.back() - chain[chain.size() - 2], p - chain.back()) <= 0) chain.pop_back();
      chain.push_back(p);
    }
    for (size_t i = 0; i + 1 < chain.size(); ++i) twice += cross(chain[i], chain[i + 1]);
    std::reverse(points.begin(), points.end());
  }
  return twice / 2;
}

Box empty_box() {
  constexpr double far = std::numeric_limits<double>::infinity();
  return {Eigen::Vector3d::Constant(far), Eigen::Vector3d::Constant(-far)};
}

void join(Box& box, const Box& other) {
  box.low = box.low.cwiseMin(other.low);
  box.high = box.high.cwiseMax(other.high);
}

}  // namespace

Hierarchy::Hierarchy(const Surface& surface) : surface_(surface), order_(surface.triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  for (const auto& p : surface.flat) {
    Eigen::Matrix2d sides;
    sides << p[1] - p[0], p[2] - p[0];
    inverse_.push_back(sides.inverse());
    area_.push_back(std::abs(sides.determinant()) / 2);
  }
  std::stable_sort(order_.begin(), order_.end(), [&](int a, int b) {
    return surface_.panel[static_cast<size_t>(a)] < surface_.panel[static_cast<size_t>(b)];
  });
  build(0, static_cast<int>(order_.size()), 0);
  int deepest = 0;
  for (const Node& node : nodes_) deepest = std::max(deepest, node.depth);
  middle_ = deepest / 2;
  add_rings();
  triangle_box_.resize(order_.size());
  along_u_.resize(order_.size());
  along_v_.resize(order_.size());
}

int Hierarchy::build(int first, int last, int depth) {
  const int index = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  node.first = first, node.last = last, node.depth = depth;
  node.convex = is_convex(node);
  for (int k = first; k < last; ++k) node.area += area_[static_cast<size_t>(order_[static_cast<size_t>(k)])];
  if (last - first > kLeafTriangles) {
    const auto panel = [&](int k) { return surface_.panel[static_cast<size_t>(order_[static_cast<size_t>(k)])]; };
    int middle = (first + last) / 2;
    if (panel(first) != panel(last - 1)) {
      // Between panels, next to the middle.
      int up = middle, down = middle;
      while (up < last && panel(up) == panel(up - 1)) ++up;
      while (down > first && panel(down) == panel(down - 1)) --down;
      middle = up < last && (down == first || up - middle <= middle - down) ? up : down;
    } else {
      const auto centre = [&](int t) -> Eigen::Vector2d {
        const auto& p = surface_.flat[static_cast<size_t>(t)];
        return p[0] + p[1] + p[2];
      };
      Eigen::Vector2d low = centre(order_[static_cast<size_t>(first)]), high = low;
      for (int k = first; k < last; ++k) {
        low = low.cwiseMin(centre(order_[static_cast<size_t>(k)]));
        high = high.cwiseMax(centre(order_[static_cast<size_t>(k)]));
      }
      const int axis = high.x() - low.x() >= high.y() - low.y() ? 0 : 1;
      std::sort(order_.begin() + first, order_.begin() + last, [&](int a, int b) {
        const Eigen::Vector2d p = centre(a), q = centre(b);
        return p(axis) != q(axis) ? p(axis) < q(axis) : p(1 - axis) != q(1 - axis) ? p(1 - axis) < q(1 - axis) : a < b;
      });
    }
    node.left = build(first, middle, depth + 1);
    node.right = build(middle, last, depth + 1);
  }
  nodes_[static_cast<size_t>(index)] = node;
  return index;
}

bool Hierarchy::is_convex(const Node& node) const {
  std::vector<Eigen::Vector2d> points;
  double area = 0;
  const int panel = surface_.panel[static_cast<size_t>(order_[static_cast<size_t>(node.first)])];
  for (int k = node.first; k < node.last; ++k) {
    const auto t = static_cast<size_t>(order_[static_cast<size_t>(k)]);
    if (surface_.panel[t] != panel) return false;
    points.insert(points.end(), surface_.flat[t].begin(), surface_.flat[t].end());
    area += area_[t];
  }
  return area >= kConvexShare * hull_area(std::move(points));
}

void Hierarchy::add_rings() {
  std::vector<std::vector<int>> around(static_cast<size_t>(surface_.vertex_count));
  for (size_t t = 0; t < surface_.triangles.size(); ++t)
    for (const int v : surface_.triangles[t]) around[static_cast<size_t>(v)].push_back(static_cast<int>(t));
  ring_.resize(nodes_.size());
  for (size_t i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i].left >= 0) continue;
    std::vector<int>& ring = ring_[i];
    for (int k = nodes_[i].first; k < nodes_[i].last; ++k) {
      const auto t = static_cast<size_t>(order_[static_cast<size_t>(k)]);
      for (const int v : surface_.triangles[t])
        for (const int other : around[static_cast<size_t>(v)])
          if (surface_.panel[static_cast<size_t>(other)] == surface_.panel[t]) ring.push_back(other);
    }
    std::sort(ring.begin(), ring.end());
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
  }
}

void Hierarchy::refit_range(Node& node) const {
  node.box = empty_box();
  for (int k = node.first; k < node.last; ++k)
    for (const int v : surface_.triangles[static_cast<size_t>(order_[static_cast<size_t>(k)])]) {
      node.box.low = node.box.low.cwiseMin(position_->col(v));
      node.box.high = node.box.high.cwiseMax(position_->col(v));
    }
}

void Hierarchy::refit_subtree(int index) {
  Node& node = nodes_[static_cast<size_t>(index)];
  if (node.left < 0) {
    node.box = empty_box();
    for (int k = node.first; k < node.last; ++k) {
      const auto t = static_cast<size_t>(order_[static_cast<size_t>(k)]);
      const auto& v = surface_.triangles[t];
      Box& box = triangle_box_[t];
      box.low = position_->col(v[0]).cwiseMin(position_->col(v[1])).cwiseMin(position_->col(v[2]));
      box.high = position_->col(v[0]).cwiseMax(position_->col(v[1])).cwiseMax(position_->col(v[2]));
      join(node.box, box);
    }
  } else {
    refit_subtree(node.left);
    refit_subtree(node.right);
    node.box = nodes_[static_cast<size_t>(node.left)].box;
    join(node.box, nodes_[static_cast<size_t>(node.right)].box);
  }
  node.fresh = update_;
}

void Hierarchy::update(const Eigen::Matrix3Xd& position) {
  position_ = &position;
  ++update_;
  for (size_t i = nodes_.size(); i-- > 0;) {
    Node& node = nodes_[i];
    if (node.depth > middle_) continue;
    if (node.left < 0 || node.depth == middle_) {
      refit_range(node);
    } else {
      node.box = nodes_[static_cast<size_t>(node.left)].box;
      join(node.box, nodes_[static_cast<size_t>(node.right)].box);
    }
  }
  update_flatness();
}

// Before the boxes below a node are looked at.
void Hierarchy::enter(int index) {
  const Node& node = nodes_[static_cast<size_t>(index)];
  if (node.fresh != update_ && (node.depth >= middle_ || node.left < 0)) refit_subtree(index);
}

void Hierarchy::update_flatness() {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, surface_.triangles.size(), 4096),
                    [&](const tbb::blocked_range<size_t>& range) {
    for (size_t t = range.begin(); t != range.end(); ++t) {
      const auto& v = surface_.triangles[t];
      const Eigen::Vector3d one = position_->col(v[1]) - position_->col(v[0]),
                            two = position_->col(v[2]) - position_->col(v[0]);
      along_u_[t] = one * inverse_[t](0, 0) + two * inverse_[t](1, 0);
      along_v_[t] = one * inverse_[t](0, 1) + two * inverse_[t](1, 1);
    }
  });
  const auto apart = [](const Node& a, const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    return std::sqrt((a.along_u - u).squaredNorm() + (a.along_v - v).squaredNorm());
  };
  for (size_t i = nodes_.size(); i-- > 0;) {
    Node& node = nodes_[i];
    node.deviation = 0;
    if (node.left < 0) {
      node.along_u = node.along_v = Eigen::Vector3d::Zero();
      for (int k = node.first; k < node.last; ++k) {
        const auto t = static_cast<size_t>(order_[static_cast<size_t>(k)]);
        node.along_u += along_u_[t] * (area_[t] / node.area);
        node.along_v += along_v_[t] * (area_[t] / node.area);
      }
      for (const int t : ring_[i])
        node.deviation =
            std::max(node.deviation, apart(node, along_u_[static_cast<size_t>(t)], along_v_[static_cast<size_t>(t)]));
    } else {
      const Node &a = nodes_[static_cast<size_t>(node.left)], &b = nodes_[static_cast<size_t>(node.right)];
      const double share = a.area / node.area;
      node.along_u = share * a.along_u + (1 - share) * b.along_u;
      node.along_v = share * a.along_v + (1 - share) * b.along_v;
      for (const Node* child : {&a, &b})
        node.deviation = std::max(node.deviation, child->deviation + apart(node, child->along_u, child->along_v));
    }
  }
}

bool Hierarchy::is_flat(const Node& node, double reach_m) const {
  if (!culling_ || !node.convex) return false;
  const double uu = node.along_u.squaredNorm(), vv = node.along_v.squaredNorm(), uv = node.along_u.dot(node.along_v);
  const double least2 = (uu + vv - std::sqrt((uu - vv) * (uu - vv) + 4 * uv * uv)) / 2;
  return (std::sqrt(std::max(0.0, least2)) - node.deviation) * surface_.least_height_m >= reach_m;
}

void Hierarchy::near_itself(double reach_m, std::vector<std::array<int, 2>>& pairs) { within(0, reach_m, pairs); }

void Hierarchy::within(int index, double reach_m, std::vector<std::array<int, 2>>& pairs) {
  const Node& node = nodes_[static_cast<size_t>(index)];
  if (is_flat(node, reach_m)) return;
  enter(index);
  if (node.left >= 0) {
    within(node.left, reach_m, pairs);
    within(node.right, reach_m, pairs);
    between(node.left, node.right, reach_m, pairs);
    return;
  }
  for (int i = node.first; i < node.last; ++i)
    for (int j = i + 1; j < node.last; ++j)
      pairs.push_back({order_[static_cast<size_t>(i)], order_[static_cast<size_t>(j)]});
}

void Hierarchy::between(int a, int b, double reach_m, std::vector<std::array<int, 2>>& pairs) {
  enter(a);
  enter(b);
  const Node &one = nodes_[static_cast<size_t>(a)], &two = nodes_[static_cast<size_t>(b)];
  if (!within_reach(one.box, two.box, reach_m)) return;
  if (one.left < 0 && two.left < 0) {
    for (int i = one.first; i < one.last; ++i)
      for (int j = two.first; j < two.last; ++j) {
        const int s = order_[static_cast<size_t>(i)], t = order_[static_cast<size_t>(j)];
        if (within_reach(triangle_box_[static_cast<size_t>(s)], triangle_box_[static_cast<size_t>(t)], reach_m))
          pairs.push_back({s, t});
      }
  } else if (two.left < 0 || (one.left >= 0 && one.area >= two.area)) {
    between(one.left, b, reach_m, pairs);
    between(one.right, b, reach_m, pairs);
  } else {
    between(a, two.left, reach_m, pairs);
    between(a, two.right, reach_m, pairs);
  }
}

void Hierarchy::near_segment(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double reach_m,
                             std::vector<int>& triangles) {
  const Box around = {from.cwiseMin(to), from.cwiseMax(to)};
  std::vector<int> open = {0};
  while (!open.empty()) {
    const int index = open.back();
    open.pop_back();
    enter(index);
    const Node& node = nodes_[static_cast<size_t>(index)];
    if (!within_reach(node.box, around, reach_m)) continue;
    if (node.left >= 0) {
      open.push_back(node.right);
      open.push_back(node.left);
      continue;
    }
    for (int k = node.first; k < node.last; ++k)
      if (within_reach(triangle_box_[static_cast<size_t>(order_[static_cast<size_t>(k)])], around, reach_m))
        triangles.push_back(order_[static_cast<size_t>(k)]);
  }
}

}  // namespace selvedge::cloth::contact
