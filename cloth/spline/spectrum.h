// The fastest motions of a flat spline sheet, from which its step and stages of damping are planned
// (cloth/step_plan.h).
#pragma once

#include <vector>

#include "cloth/material.h"
#include "cloth/spline/spline_sheet.h"
#include "cloth/step_plan.h"

namespace selvedge::cloth::spline {

// One a material. Those that differ in what no step feels, such as drag, share what is worked out.
std::vector<Spectrum> spectra_of(const SplineSheet& sheet, const std::vector<Material>& materials);

}  // namespace selvedge::cloth::spline
