// Panels, meshed and sewn: one sheet for the force kernels, one surface for contact, and a shape to start from.
//
// Vertices of sewn edges are one. Each triangle keeps its own panel's flat coordinates. Bending reads second
// derivatives from neighbours in the plane of a vertex's panel; across a seam the neighbouring panel is laid flat
// beside it, segment by segment, so that a seam bends like the fabric and not like a hinge.
// The start is the garment as it stands by itself: rings without stretch, around a vertical axis.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "cloth/contact/surface.h"
#include "cloth/sheet.h"
#include "garment/pattern.h"

namespace selvedge::garment {

struct Garment {
  cloth::Sheet sheet;
  cloth::contact::Surface surface;
  std::vector<int> held;      // vertices
  Eigen::Matrix3Xd standing;  // 3×N, m: the top ring around the origin at height 0
};

// Throws BadInput where the seams do not close: edges sewn inside out or twice, panels of different height.
Garment sew(const Pattern& pattern);

}  // namespace selvedge::garment
