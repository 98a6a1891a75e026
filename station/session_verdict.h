// What a session is worth, in one sentence: how many of its fabrics were recorded, fitted and diagnosed, and how many
// of those answers are to be believed.
//
// Trusted as far as the least of its parts. Not to be believed: a fit or diagnosis that is not, or a refused
// calibration. With care: a fit or diagnosis that is to be taken so, a doubtful calibration, a step that was given up,
// failed, or was cut off, a trial that the plan asks for and that is not there.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "report/verdict.h"

namespace selvedge::station {

// summary: of session.json.
report::Verdict verdict_of_session(const nlohmann::json& summary);

}  // namespace selvedge::station
