// A mesh made ready for the force kernels: gradients, areas, bending stencils, incidence.
#pragma once

#include <vector>

#include "cloth/kernel/sheet_data.h"
#include "cloth/material.h"
#include "geometry/triangle_mesh.h"

namespace selvedge::cloth {

struct Sheet {
  geometry::TriangleMesh mesh;
  kernel::SheetData data;
};

// Throws std::invalid_argument where a triangle has no area or the mesh is too small for second derivatives.
Sheet make_sheet(const geometry::TriangleMesh& mesh);

// Largest stable leapfrog step, s, for the stiffest and most damped of the materials, from the sheet's highest
// frequencies and damping rates (power iteration on the flat sheet), with a margin of 15 %.
double stable_step_s(const Sheet& sheet, const Material& material);

}  // namespace selvedge::cloth
