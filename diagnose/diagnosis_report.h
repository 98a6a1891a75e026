// What a diagnosis leaves: diagnosis.json (docs/formats.md), report.html and the session that it proposes.
#pragma once

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "diagnose/diagnosis.h"

namespace selvedge::diagnose {

nlohmann::json to_json(const Diagnosis& diagnosis);

// Writes diagnosis.json, report.html and next_session.toml; each whole or not at all.
void write_diagnosis(const Diagnosis& diagnosis, const std::filesystem::path& folder);

}  // namespace selvedge::diagnose
