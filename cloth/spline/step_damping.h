// What damping of bending does to velocities over one step of a spline sheet (lane_run.h), one direction of it.
#pragma once

#include "cloth/spline/spline_sheet.h"

namespace selvedge::cloth::spline {

inline constexpr Eigen::Index kStepDampingReach = 6;  // of the matrices, to either side of the diagonal

// added: B − 1, B = (1 + share R K)⁻¹; twist: √2 B A / (1 + c² A²), A = √share R S B. R: inverse mass, K: bending, S:
// slopes' products of a direction. Next to a free rim A exceeds the half that it stays below elsewhere; bounded by 1/2c
// in each direction, the twist never turns a velocity round.
struct StepDamping {
  Eigen::MatrixXd added, twist;

  // share: step · damping / density, m⁴.
  StepDamping(const Side& side, double share);
};

}  // namespace selvedge::cloth::spline
