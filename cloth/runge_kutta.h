// The paper's integrator, kept as the reference: explicit Runge–Kutta 4(5) of Dormand and Prince with the
// embedded error estimate and a step that follows it (Bhat et al. 2003, section 3; Hairer, Nørsett & Wanner,
// Solving Ordinary Differential Equations I, table II.5.2).
#pragma once

#include "cloth/simulate.h"

namespace selvedge::cloth {

// Fills trajectory.samples from trajectory.start at rest. tolerance_m: largest error of a position in a step
// (velocities: times 1/s). Friction and creep take one explicit step after each accepted step.
void run_runge_kutta(const Sheet& sheet, const Experiment& experiment, double tolerance_m, Trajectory& trajectory);

}  // namespace selvedge::cloth
