// From a shape to the equilibrium in whose valley it lies, on a spline sheet.
#pragma once

#include "cloth/simulate.h"
#include "cloth/spline/spline_sheet.h"

namespace selvedge::cloth::spline {

struct Settled {
  Eigen::Matrix3Xd position;  // control points, m: the equilibrium, or the shape nearest to one that was found
  bool at_rest = false;
  int steps = 0, factorised = 0;
};

// Limited-memory BFGS (Nocedal & Wright 2006, algorithm 7.4) on the forces alone, whose first guess of the inverse
// Hessian is the tangent stiffness, factorised again as the sheet moves away from where it was: as it is where steps
// are short and it is positive, else kept positive. What the rig holds is kept by Lagrange's multipliers, its reactions
// are taken from the forces. Steps along which the forces still push. Ends with the first step that moves no control
// point by a tenth of change_m. A start that is far is brought nearer on a grid of twice the cells first.
Settled settle(const SplineSheet& sheet, const Experiment& experiment, const Eigen::Matrix3Xd& start, double change_m);

}  // namespace selvedge::cloth::spline
