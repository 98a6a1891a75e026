// The fastest motions of a flat spline sheet, from which its step and stages of damping are planned
// (cloth/step_plan.h).
#pragma once

#include "cloth/material.h"
#include "cloth/spline/spline_sheet.h"
#include "cloth/step_plan.h"

namespace selvedge::cloth::spline {

Spectrum spectrum_of(const SplineSheet& sheet, const Material& material);

}  // namespace selvedge::cloth::spline
