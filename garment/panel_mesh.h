// One panel as a grid over its Coons patch.
#pragma once

#include "garment/pattern.h"
#include "geometry/triangle_mesh.h"

namespace selvedge::garment {

struct PanelMesh {
  int columns = 0, rows = 0;    // vertices
  geometry::TriangleMesh mesh;  // vertex (column c, row r) at r·columns + c

  // Vertices along an edge, in its direction.
  std::vector<int> along(Edge edge) const;
};

// As many vertices along edges that are sewn together, and about the spacing between them.
std::vector<PanelMesh> mesh_panels(const Pattern& pattern);

}  // namespace selvedge::garment
