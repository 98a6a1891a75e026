// What a fit found, for a terminal: parameters, errors, remarks. A number that is not there is a dash, or the word why.
#pragma once

#include <string>
#include <vector>

#include "fit/fit_outcome.h"

namespace selvedge::fit {

std::string outcome_text(const FitOutcome& outcome);

// What grid it was fitted on, and what that leaves open.
std::string grid_sentence(const FitOutcome& outcome);

// Of what was held out: "0.9 … 1.4" with that between; none where nothing was, or the word why.
std::string held_out_interval(const TrialError& trial, const std::string& between, const std::string& none);

// The outcome's remarks, and what parameters the trials do not tell apart, which the page shows as a map.
std::vector<std::string> remarks_of(const FitOutcome& outcome);

}  // namespace selvedge::fit
