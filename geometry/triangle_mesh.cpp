#include "geometry/triangle_mesh.h"

#include <limits>
#include <stdexcept>

#include <Eigen/LU>

namespace selvedge::geometry {

TriangleMesh make_grid_mesh(double width_m, double height_m, int columns, int rows) {
  if (columns < 2 || rows < 2) throw std::invalid_argument("make_grid_mesh: at least 2 columns and 2 rows");
  TriangleMesh mesh;
  mesh.width_m = width_m;
  mesh.height_m = height_m;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      mesh.rest_uv.emplace_back(width_m * c / (columns - 1), height_m * r / (rows - 1));
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
  int best = -1;
  double distance = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < mesh.rest_uv.size(); ++i) {
    const double d = (mesh.rest_uv[i] - uv).squaredNorm();
    if (d < distance) {
      distance = d;
      best = static_cast<int>(i);
    }
  }
  return best;
}

MaterialPoint locate(const TriangleMesh& mesh, const Eigen::Vector2d& uv) {
  MaterialPoint best;
  double best_lowest = -std::numeric_limits<double>::infinity();
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector2d& origin = mesh.rest_uv[static_cast<size_t>(t[0])];
    Eigen::Matrix2d sides;
    sides << mesh.rest_uv[static_cast<size_t>(t[1])] - origin, mesh.rest_uv[static_cast<size_t>(t[2])] - origin;
    const Eigen::Vector2d w = sides.inverse() * (uv - origin);
    const Eigen::Vector3d weights(1 - w.sum(), w.x(), w.y());
    if (weights.minCoeff() > best_lowest) {
      best_lowest = weights.minCoeff();
      best = {t, weights};
    }
  }
  return best;
}

}  // namespace selvedge::geometry
