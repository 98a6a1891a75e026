// Implicit Euler as Baraff & Witkin 1998 take it, kept to measure the damping for which Bhat et al. 2003
// rejected it: one linear solve a step of fixed length,
//   (M + h D + h² K) Δv = h M a(x, v) − h² K v,  v += Δv,  x += h v,
// K = −∂f/∂x of stretch, shear and bending (parts that compression makes indefinite left out), D = −∂f/∂v of
// the material's damping; drag and whatever the base model lacks act explicitly.
#pragma once

#include "cloth/simulate.h"

namespace selvedge::cloth {

// Fills trajectory.samples from trajectory.start at rest.
void run_implicit_euler(const Sheet& sheet, const Experiment& experiment, double step_s, Trajectory& trajectory);

}  // namespace selvedge::cloth
