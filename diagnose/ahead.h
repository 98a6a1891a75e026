// Predictions for a short time ahead: what the gap reduction is told by.
//
// What a motion that runs free does for seconds hangs on the way that its folds happened to snap, in any arm; two
// recordings of one fabric then tell different gap reductions. Here a simulation is held near the recording
// (cloth/guide.h), let go, and judged on the quarter of a second that follows; a second run is let go where the first
// was held, so that every sample is predicted once, from a shape held at most Protocol::ahead_s before. Fabric that
// hangs still is not held. Of 0.15, 0.25 and 0.5 s in four campaigns of the simulated world, 0.25 told gap reductions
// most alike in their own and in fresh trials (docs/decisions/0013).
#pragma once

#include <vector>

#include "diagnose/protocol.h"
#include "model/simulation.h"

namespace selvedge::diagnose {

// Root mean square error of each trial wanted (empty: all), mm: parameter set × trial of the simulation, NaN where a
// simulation diverged or the trial is not wanted. Distance of markers in space; single samples are cut at 6 robust
// deviations. The state's grid corrections and hold are left aside.
Eigen::MatrixXd ahead_mm(const model::Simulation& simulation, const model::State& state, const Protocol& protocol,
                         const std::vector<model::Parameter>& parameters, const Eigen::MatrixXd& coordinates,
                         const std::vector<size_t>& trials = {});

}  // namespace selvedge::diagnose
