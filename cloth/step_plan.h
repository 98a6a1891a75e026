// How long a leapfrog step may be, and in how many stages its damping is taken.
//
// The material's damping D makes fast modes stiff: λ = largest eigenvalue of M⁻¹D is 3e4 1/s for a 33 × 33
// sheet, so that a step that lags it must stay below 2/λ, far below what waves or drag ask for. Here the
// velocity obeys v̇ = a − M⁻¹D v over one step with the shape held, solved by the stages of a first-order
// Runge–Kutta–Chebyshev method (van der Houwen & Sommeijer 1980; Verwer 1996): v is multiplied by
//   P(z) = T_s(w0 − w1 z) / T_s(w0),  z = hλ,  w1 = T_s(w0)/T_s'(w0),
// which is 1 − z + O(z²) for the modes one sees and stays within ±1/T_s(w0) up to z = (w0 + 1)/w1 ≈ 2s².
// A mode of frequency ω and damping rate λ is then stable where h²ω² (1 − P)/z ≤ 2 (1 + P). Where other damping is
// implicit (spline/damped_inertia.h), it takes some of a velocity beside the stages, up to q = h λ_i / (1 + θ h λ_i):
// P − q (1 − P)/z stands in the place of P. No stage adds damping of its own: with D = 0 the step is plain leapfrog.
#pragma once

#include "cloth/kernel/run.h"
#include "cloth/sheet.h"

namespace selvedge::cloth {

// The fastest motions of a flat sheet, by power iteration.
struct Spectrum {
  double membrane_omega2 = 0;  // 1/s², in the plane
  double membrane_lambda = 0;  // 1/s
  double membrane_ratio = 0;   // 1/s, largest stiffness per damping; infinite without damping
  double bend_omega2 = 0, bend_lambda = 0, bend_ratio = 0;
  double tension = 0;          // largest strain expected, which makes sideways waves stiff
  double implicit_lambda = 0;  // 1/s, of damping that a step takes by an inertia larger by kImplicit h λ
  int most_stages = 6;         // that a plan looks at, up to DampingStages::kMost
  double stage_cost = 0.53;    // of one evaluation of all forces
};
Spectrum spectrum_of(const Sheet& sheet, const Material& material);

struct StepPlan {
  double step_s = 0;
  kernel::DampingStages stages;
};

// θ, by which implicit damping is overdone (spline/damped_inertia.h says why).
inline constexpr double kImplicit = 4;

// The step with the least work per second, with a margin of 15 %, at most kLongestStep_s.
inline constexpr double kLongestStep_s = 4e-4;
StepPlan plan_step(const Spectrum& spectrum);

// The fewest stages that a step of this length needs.
kernel::DampingStages stages_for(const Spectrum& spectrum, double step_s);

}  // namespace selvedge::cloth
