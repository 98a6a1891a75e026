// The sections of a fit's report that its numbers make: parameters, errors, progress.
#pragma once

#include "fit/fit_outcome.h"
#include "report/html.h"

namespace selvedge::fit {

void add_parameters(report::HtmlReport& html, const FitOutcome& out);
void add_errors(report::HtmlReport& html, const FitOutcome& out);
void add_progress(report::HtmlReport& html, const FitOutcome& out);

}  // namespace selvedge::fit
