// Bending of a whole sheet as rows of one matrix.
#pragma once

#include "cloth/kernel/sheet_data.h"

namespace selvedge::cloth {

// Q of the energy ½ Σ x_i·Q_ij x_j from the sheet's stencils and areas: Σ A (uu uuᵀ + 2 uv uvᵀ + vv vvᵀ). Entries below
// 1e-10 of the largest are left out, and rows of a regular mesh that differ by no more become one, so that a kernel
// reads them once for several vertices.
kernel::BendMatrix make_bend_matrix(const kernel::SheetData& sheet);

}  // namespace selvedge::cloth
