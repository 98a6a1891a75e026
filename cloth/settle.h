// From a shape that lies near an equilibrium to that equilibrium.
#pragma once

#include "cloth/simulate.h"

namespace selvedge::cloth {

struct Settled {
  Eigen::Matrix3Xd position;  // 3×N, m
  bool at_rest = false;       // false: not near one, or it was not reached; position is then of no use
};

// Limited-memory BFGS (Nocedal & Wright 2006, algorithm 7.4) on the forces alone, whose first guess of the inverse
// Hessian is the stiffness at the start, factorised once; steps along which the forces still push, none longer than a
// few mm, so that it does not leave the valley it starts in. Ends where the next step would move no vertex by a tenth
// of change_m. Gives up where the first step is long: such a start is better brought nearer by motion (kernel::relax).
Settled settle(const Sheet& sheet, const Experiment& experiment, const Eigen::Matrix3Xd& start, double change_m);

}  // namespace selvedge::cloth
