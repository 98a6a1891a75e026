// A mesh made ready for the force kernels: gradients, areas, bending stencils, incidence.
#pragma once

#include <vector>

#include "cloth/kernel/sheet_data.h"
#include "geometry/triangle_mesh.h"

namespace selvedge::cloth {

struct Sheet {
  geometry::TriangleMesh mesh;
  kernel::SheetData data;
};

// How long fabric is taken to be between two vertices: as their distance, or as an arc bent like the sheet is there
// (kernel/arc_length.h), which costs 1.7 times as much a step and from 17 columns on moves a soft swatch as twice as
// many columns do. Fits take straight sides (docs/decisions/0010 says why).
enum class Sides { straight, arcs };

// Throws std::invalid_argument where a triangle has no area or the mesh is too small for second derivatives.
Sheet make_sheet(const geometry::TriangleMesh& mesh, Sides sides = Sides::straight);

}  // namespace selvedge::cloth
