// Figures of the calibration's watch (station/calibration_watch.h) on campaigns recorded from the simulated world,
// whose knocks and delays are known.
#pragma once

#include <vector>

#include "cli/verify/figures.h"

namespace selvedge::cli {

std::vector<Figure> prove_calibration_watch(const FigureOptions& options);

}  // namespace selvedge::cli
