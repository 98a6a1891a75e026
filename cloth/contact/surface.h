// A fabric's triangles as contact sees them: vertices, edges, who stands for which, and the flat state.
//
// Pairs of features (vertex–triangle, edge–edge) are found through pairs of triangles. So that none is found
// twice, each vertex and each edge belongs to one of its triangles, its owner (S. Curtis, R. Tamstorf &
// D. Manocha, Fast collision detection for deformable models using representative-triangles, I3D 2008).
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "geometry/triangle_mesh.h"

namespace selvedge::cloth::contact {

struct Surface {
  int vertex_count = 0;
  std::vector<std::array<int, 3>> triangles;
  std::vector<std::array<Eigen::Vector2d, 3>> flat;           // corners in the plane of the triangle's panel, m
  std::vector<int> panel;                                     // per triangle
  std::vector<std::array<int, 2>> edges;                      // vertices, the lower index first
  std::vector<std::vector<int>> owned_vertices, owned_edges;  // per triangle
  double least_height_m = 0;                                  // smallest height of a flat triangle
};

// flat, panel: one a triangle. Throws std::invalid_argument where the sizes differ or a triangle has no area.
Surface make_surface(int vertex_count, std::vector<std::array<int, 3>> triangles,
                     std::vector<std::array<Eigen::Vector2d, 3>> flat, std::vector<int> panel);

// A single panel.
Surface make_surface(const geometry::TriangleMesh& mesh);

}  // namespace selvedge::cloth::contact
