// The steps of a session that need nothing but files: fit and diagnosis of a fabric, and what a second session makes of
// them. They run where the session runs,
// or on whatever host sees the same folder.
#pragma once

#include <filesystem>
#include <vector>

#include <nlohmann/json.hpp>

#include "diagnose/effects/effect.h"
#include "report/progress.h"
#include "station/session_file.h"
#include "station/session_steps.h"

namespace selvedge::station {

// What the diagnosis may name. Throws BadInput where the session file asks for an effect that is not known.
std::vector<diagnose::Effect> diagnosed_effects(const SessionFile& file);

// "fit", "diagnose" or "confirm", of FOLDER/FABRIC with its campaign.json. Returns what the journal keeps of it. One
// that was cut off goes on from what it left: a fit from its iterations, a diagnosis from its base fit.
nlohmann::json run_on_files(const SessionFile& file, const Step& step, const std::filesystem::path& folder,
                            const report::ProgressCallback& progress);

}  // namespace selvedge::station
