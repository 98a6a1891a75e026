#include "geometry/triangle_mesh.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "geometry/plane.h"

namespace selvedge::geometry {

namespace {

Eigen::Vector3d barycentric(const TriangleMesh& mesh, const std::array<int, 3>& triangle, const Eigen::Vector2d& uv) {
  const Eigen::Vector2d& a = mesh.rest_uv[triangle[0]];
  const Eigen::Vector2d& b = mesh.rest_uv[triangle[1]];
  const Eigen::Vector2d& c = mesh.rest_uv[triangle[2]];
  const double area = cross(b - a, c - a);
  const double second = cross(uv - a, c - a) / area, third = cross(b - a, uv - a) / area;
  return {1 - second - third, second, third};
}

double squared_distance_to_segment(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double t = std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (p - a - t * along).squaredNorm();
}

double squared_distance_to_edges(const TriangleMesh& mesh, const std::array<int, 3>& triangle,
                                 const Eigen::Vector2d& uv) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i)
    nearest = std::min(nearest,
                       squared_distance_to_segment(uv, mesh.rest_uv[triangle[i]], mesh.rest_uv[triangle[(i + 1) % 3]]));
  return nearest;
}

}  // namespace

TriangleMesh make_grid_mesh(double width_m, double height_m, int columns, int rows) {
  if (!(width_m > 0 && height_m > 0) || columns < 2 || rows < 2)
    throw std::invalid_argument("make_grid_mesh: " + std::to_string(columns) + "x" + std::to_string(rows) +
                                " vertices over " + std::to_string(width_m) + "x" + std::to_string(height_m) +
                                " m, expected at least 2x2 and positive sides");
  TriangleMesh mesh;
  mesh.width_m = width_m;
  mesh.height_m = height_m;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) mesh.rest_uv.emplace_back(width_m * c / (columns - 1), height_m * r / (rows - 1));
  for (int r = 0; r + 1 < rows; ++r)
    for (int c = 0; c + 1 < columns; ++c) {
      const int a = r * columns + c, b = a + 1, d = a + columns, e = d + 1;
      if ((r + c) % 2 == 0) {
        mesh.triangles.push_back({a, b, e});
        mesh.triangles.push_back({a, e, d});
      } else {
        mesh.triangles.push_back({a, b, d});
        mesh.triangles.push_back({b, e, d});
      }
    }
  return mesh;
}

int nearest_vertex(const TriangleMesh& mesh, const Eigen::Vector2d& uv) {
  int nearest = -1;
  double smallest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < mesh.rest_uv.size(); ++i) {
    const double distance = (mesh.rest_uv[i] - uv).squaredNorm();
    if (distance < smallest) {
      smallest = distance;
      nearest = static_cast<int>(i);
    }
  }
  return nearest;
}

MaterialPoint locate(const TriangleMesh& mesh, const Eigen::Vector2d& uv) {
  if (mesh.triangles.empty()) throw std::invalid_argument("locate: the mesh has no triangles");
  constexpr double rounding = 1e-12;
  const std::array<int, 3>* best = nullptr;
  double smallest = std::numeric_limits<double>::infinity();
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d weights = barycentric(mesh, triangle, uv);
    if (weights.minCoeff() >= -rounding) return {triangle, weights};
    const double distance = squared_distance_to_edges(mesh, triangle, uv);
    if (distance < smallest) {
      smallest = distance;
      best = &triangle;
    }
  }
  return {*best, barycentric(mesh, *best, uv)};
}

}  // namespace selvedge::geometry
