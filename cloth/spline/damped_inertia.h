// The inverse mass of one direction of a spline sheet that bears bending's damping over a step.
//
// Damping of bending is even and far stiffer than a step is short: 1e6 1/s on 50 cells. As a force at the beginning of
// a step it would diverge. So the step is linearly implicit: with M = R⁻¹ and the bending K of a direction, the masses
// are (M + θ h D K / ρ) ⊗ (M + θ h D K / ρ). What is at rest, or moves evenly, feels nothing of it whatever the step,
// for the force is the whole force; a slow mode whose damping rate is λ has an inertia larger by θ h λ. θ = 4: on an
// endless sheet ½ were enough; at a free rim slopes' products reach twice what they are inside, and the twist, which
// the product of two directions does not hold, asks for 1.25; what the membrane takes in the same step the plan
// counts beside it (cloth/step_plan.h).
#pragma once

#include "cloth/spline/spline_sheet.h"

namespace selvedge::cloth::spline {

// damping: h D / ρ, m⁴. Kept to a band: what lies beyond is less than 1e-4 of a row's largest, and goes where motions
// that are constant or linear stay what they are.
Eigen::MatrixXd damped_inverse(const Side& side, double damping);

// Entries to either side of the diagonal that are not 0.
Eigen::Index reach_of(const Eigen::MatrixXd& matrix);

}  // namespace selvedge::cloth::spline
