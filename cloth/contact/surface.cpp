#include "cloth/contact/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

namespace selvedge::cloth::contact {

namespace {

double least_height(const std::array<Eigen::Vector2d, 3>& p) {
  const Eigen::Vector2d a = p[1] - p[0], b = p[2] - p[0];
  const double twice_area = std::abs(a.x() * b.y() - a.y() * b.x());
  return twice_area / std::max({a.norm(), b.norm(), (b - a).norm()});
}

}  // namespace

Surface make_surface(int vertex_count, std::vector<std::array<int, 3>> triangles,
                     std::vector<std::array<Eigen::Vector2d, 3>> flat, std::vector<int> panel) {
  if (flat.size() != triangles.size() || panel.size() != triangles.size())
    throw std::invalid_argument("make_surface: expected flat corners and a panel for each triangle");
  Surface s;
  s.vertex_count = vertex_count;
  s.triangles = std::move(triangles);
  s.flat = std::move(flat);
  s.panel = std::move(panel);
  s.owned_vertices.resize(s.triangles.size());
  s.owned_edges.resize(s.triangles.size());
  s.least_height_m = std::numeric_limits<double>::infinity();
  std::vector<bool> owned(static_cast<size_t>(vertex_count), false);
  std::map<std::array<int, 2>, int> known;
  for (size_t t = 0; t < s.triangles.size(); ++t) {
    for (size_t k = 0; k < 3; ++k) {
      const int v = s.triangles[t][k], w = s.triangles[t][(k + 1) % 3];
      if (!owned[static_cast<size_t>(v)]) s.owned_vertices[t].push_back(v);
      owned[static_cast<size_t>(v)] = true;
      const std::array<int, 2> edge = {std::min(v, w), std::max(v, w)};
      if (!known.emplace(edge, static_cast<int>(s.edges.size())).second) continue;
      s.owned_edges[t].push_back(static_cast<int>(s.edges.size()));
      s.edges.push_back(edge);
    }
    s.least_height_m = std::min(s.least_height_m, least_height(s.flat[t]));
  }
  if (!(s.least_height_m > 0)) throw std::invalid_argument("make_surface: a triangle has no area");
  return s;
}

Surface make_surface(const geometry::TriangleMesh& mesh) {
  std::vector<std::array<Eigen::Vector2d, 3>> flat;
  for (const auto& t : mesh.triangles)
    flat.push_back({mesh.rest_uv[static_cast<size_t>(t[0])], mesh.rest_uv[static_cast<size_t>(t[1])],
                    mesh.rest_uv[static_cast<size_t>(t[2])]});
  return make_surface(static_cast<int>(mesh.rest_uv.size()), mesh.triangles, std::move(flat),
                      std::vector<int>(mesh.triangles.size(), 0));
}

}  // namespace selvedge::cloth::contact
