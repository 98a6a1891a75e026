#include "cloth/contact/intersections.h"

#include <algorithm>

#include <Eigen/Geometry>

#include "cloth/contact/hierarchy.h"

namespace selvedge::cloth::contact {

namespace {

// Six times the signed volume of a tetrahedron.
double volume(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& d) {
  return (b - a).cross(c - a).dot(d - a);
}

bool edges_cross(const std::array<int, 3>& edges_of, const std::array<int, 3>& triangle, const Eigen::Matrix3Xd& x) {
  const auto shared = [&](int v) { return v == triangle[0] || v == triangle[1] || v == triangle[2]; };
  for (size_t k = 0; k < 3; ++k) {
    const int v = edges_of[k], w = edges_of[(k + 1) % 3];
    if (shared(v) || shared(w)) continue;
    if (crosses(x.col(v), x.col(w), x.col(triangle[0]), x.col(triangle[1]), x.col(triangle[2]))) return true;
  }
  return false;
}

}  // namespace

bool crosses(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
             const Eigen::Vector3d& c) {
  const double above = volume(a, b, c, from), below = volume(a, b, c, to);
  // Rounding puts a segment of the triangle's own plane on either side.
  const double rounding = 1e-11 * (b - a).norm() * (c - a).norm() * ((from - a).norm() + (to - a).norm());
  if (std::min(above, below) > -rounding || std::max(above, below) < rounding) return false;
  const double ab = volume(from, to, a, b), bc = volume(from, to, b, c), ca = volume(from, to, c, a);
  return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

std::vector<std::array<int, 2>> intersecting_triangles(const Surface& surface, const Eigen::Matrix3Xd& position) {
  Hierarchy tree(surface);
  tree.set_culling(false);
  tree.update(position);
  std::vector<std::array<int, 2>> pairs;
  tree.near_itself(0, pairs);
  std::erase_if(pairs, [&](const std::array<int, 2>& pair) {
    const auto &a = surface.triangles[static_cast<size_t>(pair[0])],
               &b = surface.triangles[static_cast<size_t>(pair[1])];
    return !edges_cross(a, b, position) && !edges_cross(b, a, position);
  });
  return pairs;
}

}  // namespace selvedge::cloth::contact
