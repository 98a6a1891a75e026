// fit.json and report.html of a fit.
#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "fit/fit_campaign.h"

namespace selvedge::fit {

// The fixed keys of the exchange format, and `held_out`, `remarks` beside them.
nlohmann::json to_json(const FitOutcome& outcome);

// Writes DIR/fit.json and DIR/report.html. The campaign's frames are read again for the pictures.
void write_fit(const FitOutcome& outcome, const trial::Campaign& campaign, const std::filesystem::path& folder);

}  // namespace selvedge::fit
