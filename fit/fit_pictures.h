// Recorded beside simulated: frames, angle maps and their difference for trials with images; dots and the
// simulated sheet for trials with markers.
#pragma once

#include "fit/fit_outcome.h"
#include "report/html.h"

namespace selvedge::fit {

void add_pictures(report::HtmlReport& html, const FitOutcome& outcome, const trial::Campaign& campaign);

}  // namespace selvedge::fit
