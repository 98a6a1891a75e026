// A panel of a garment: a sheet whose stencils also read vertices that belong to its neighbours.
#pragma once

#include "cloth/sheet.h"

namespace selvedge::cloth {

// As make_sheet, but only the first `own` vertices get bending stencils; the rest, which no triangle needs to
// use, only serve as their neighbours.
Sheet make_bordered_sheet(const geometry::TriangleMesh& mesh, int own);

}  // namespace selvedge::cloth
