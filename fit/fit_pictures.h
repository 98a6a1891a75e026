// Recorded beside simulated: each trial in motion, with the markers or points of the surface that were recorded; for
// trials with images frames that one can flip through, angle maps and their difference.
#pragma once

#include "fit/fit_outcome.h"
#include "report/html.h"

namespace selvedge::fit {

void add_pictures(report::HtmlReport& html, const FitOutcome& outcome, const trial::Campaign& campaign);

}  // namespace selvedge::fit
