// Fitting a campaign: from recorded trials to parameters with their uncertainty.
//
//   1. observe    each trial becomes an experiment to simulate and residuals to compare
//   2. coarse     a search over the decisive parameters on a coarse grid gives the start
//   3. refine     robust least squares on cells of a bending length, on finer ones while the next finer grid moves the
//                 fabric, and with what that adds to the residuals
//   4. hold out   what was not fitted is predicted: later frames, or whole trials in two folds
//   5. judge      interval, variability and bounds of each parameter
#pragma once

#include <string>
#include <vector>

#include "capture/trial/trial.h"
#include "fit/fit_outcome.h"

namespace selvedge::fit {

// By its name: automatic, frames, trials or none. Throws BadInput for another.
HoldOut hold_out_named(const std::string& word);

// The hash of what a fit with this drag law rests on: recordings (their hash) and code (estimate/kept_input.h).
std::string input_of(const std::string& recordings, model::Drag drag);
// The same with another simulator.
std::string input_of(const std::string& recordings, const model::Simulator& simulator);

// What a fit begins from, without material tests.
std::vector<model::Parameter> fitted_parameters(const FitOptions& options);

// Material tests in the campaign give the parameters that they determine their start and their prior
// (tested_parameters.h); what else there is lists the trials that hang from a rig alone. Throws BadInput where there is
// none of those.
FitOutcome fit_campaign(const trial::Campaign& campaign, const FitOptions& options = {});

}  // namespace selvedge::fit
