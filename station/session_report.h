// What a session came to: session.json, and report.html with the fabrics side by side.
//
// Made from what the session left on disk, so that it can be made again, and while the session still runs. Where the
// simulated devices left truth.json, what was found is set beside it; nothing before this has read it.
#pragma once

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "station/session_file.h"

namespace selvedge::station {

// Writes FOLDER/session.json and FOLDER/report.html. Returns the former:
// {"format": "session/1", "verdict", "fabrics": {NAME: {"trials", "fit", "diagnosis", "confirmation", "truth"}},
// "steps": {ID: {…}}, "calibration"}.
nlohmann::json write_session_report(const SessionFile& file, const std::filesystem::path& folder);

// The verdict, then about a line a fabric, for the terminal.
std::string session_text(const nlohmann::json& summary);

}  // namespace selvedge::station
