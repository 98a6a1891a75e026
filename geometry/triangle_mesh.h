// A fabric's triangles in its flat state.
//
// rest_uv: N flat positions, m; u from the left edge along the top edge, v down from the top edge.
// triangles: T triples of vertex indices, all in the same sense: from u towards v, so that the signed area
// ½ (uv₁ − uv₀) × (uv₂ − uv₀) is positive.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

namespace selvedge::geometry {

struct TriangleMesh {
  std::vector<Eigen::Vector2d> rest_uv;
  std::vector<std::array<int, 3>> triangles;
  double width_m = 0;
  double height_m = 0;
};

// A grid of columns × rows vertices (at least 2 × 2), vertex (column c, row r) at index r·columns + c.
// Diagonals alternate from cell to cell so that the sheet has no built-in skew.
TriangleMesh make_grid_mesh(double width_m, double height_m, int columns, int rows);

// About the density of the columns × rows grid, but interior vertices of a triangular lattice turned by
// angle_rad and jittered; the outline stays the rectangle. Delaunay-triangulated.
// seed: of the jitter's local generator.
TriangleMesh make_irregular_mesh(double width_m, double height_m, int columns, int rows, double angle_rad,
                                 unsigned seed);

// Index of the vertex nearest to (u, v).
int nearest_vertex(const TriangleMesh& mesh, const Eigen::Vector2d& uv);

// Where a flat point lies: its triangle (the nearest one where it is outside) and barycentric weights.
struct MaterialPoint {
  std::array<int, 3> vertices{};
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();
};
MaterialPoint locate(const TriangleMesh& mesh, const Eigen::Vector2d& uv);

}  // namespace selvedge::geometry
