// Stretch of a fabric from pulls along the warp and the weft together: one orthotropic law (stretch_law.h).
//
// The sheet's own law is fitted up to the stretch to which it holds within the scatter of the pulls, and gives the
// parameters stretch, stretch_anisotropy, coupling and stretch_stiffening; the law of large strain is fitted to all of
// it and reported beside.
#pragma once

#include <vector>

#include "capture/trial/trial.h"
#include "material_tests/answer.h"
#include "material_tests/pull_curve.h"
#include "material_tests/small_fit.h"
#include "material_tests/stretch_law.h"

namespace selvedge::material_tests {

struct StretchFit {
  StretchLaw law;
  // Of ln k_u, ln k_v, ν, β (β_u, β_v, ln ℓ_u, ln ℓ_v with large), and ln of the narrowing seen along v over that along
  // u; residuals in scatters.
  SmallFit fit;
  double longest = 0;  // stretch along up to which curves were compared
  Scatter rms{};       // of what is compared, in stretch; 0 where nothing was
};

// Points of the curves whose stretch along is at most `longest`. large: as StretchLaw's.
StretchFit fit_stretch_law(const std::vector<PullCurve>& curves, const Scatter& scatter, bool large,
                           double longest = 1e300);

// Root mean square of what curves of the direction show less what the law gives, [0: along, 1: across].
std::array<double, 2> misfit(const StretchLaw& law, const std::vector<PullCurve>& curves, int direction,
                             double longest = 1e300);

// Trials of kind tensile, of one fabric. Parameters in N/m where force was recorded in a unit that is known (N, cN, gf,
// kgf, lbf), else per that unit. Throws BadInput where no strip runs along the warp or the weft.
Answer fit_tensile(const std::vector<const trial::Trial*>& strips);

}  // namespace selvedge::material_tests
