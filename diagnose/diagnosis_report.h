// What a diagnosis leaves: diagnosis.json (docs/formats.md), report.html and the session that it proposes.
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "diagnose/diagnosis.h"

namespace selvedge::diagnose {

// "3.59 → 1.64" and "0.64 (0.55 … 0.79)", for tables; no interval where there is none.
std::string before_and_after(const GapReduction& reduction);
std::string share_closed(const GapReduction& reduction);

nlohmann::json to_json(const Diagnosis& diagnosis);

// Writes diagnosis.json, report.html and next_session.toml; each whole or not at all.
void write_diagnosis(const Diagnosis& diagnosis, const std::filesystem::path& folder);

}  // namespace selvedge::diagnose
