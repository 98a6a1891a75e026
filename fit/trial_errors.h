// The errors of a fit's trials, before it and after.
#pragma once

#include <optional>

#include "fit/fit_outcome.h"

namespace selvedge::fit {

// FitOutcome::trials, of its residuals; what whole trials held out would leave is not among them.
void list_errors(FitOutcome& out);

// Held-out error over all trials, root mean square, mm; of the model and of the rigid plate.
double held_out_mm(const FitOutcome& outcome);
std::optional<double> rigid_plate_mm(const FitOutcome& outcome);
// Of what was fitted, in motion where something moves, of trials of which something was held out; NaN: of none.
double fitted_mm(const FitOutcome& outcome);

}  // namespace selvedge::fit
