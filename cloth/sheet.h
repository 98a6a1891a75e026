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

// Throws std::invalid_argument where a triangle has no area or the mesh is too small for second derivatives.
Sheet make_sheet(const geometry::TriangleMesh& mesh);

}  // namespace selvedge::cloth
