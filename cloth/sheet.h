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
// (kernel/arc_length.h), which costs about half as much again a step and lets half as many columns serve.
enum class Sides { straight, arcs };

// Throws std::invalid_argument where a triangle has no area or the mesh is too small for second derivatives.
Sheet make_sheet(const geometry::TriangleMesh& mesh, Sides sides = Sides::arcs);

}  // namespace selvedge::cloth
