// fit.json and report.html of a fit.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "fit/fit_outcome.h"

namespace selvedge::fit {

// The fixed keys of the exchange format, and `held_out`, `remarks` beside them.
nlohmann::json to_json(const FitOutcome& outcome);

// Writes DIR/fit.json and DIR/report.html. campaign: of what hangs from a rig, without material tests. Its frames are
// read again for the pictures.
void write_fit(const FitOutcome& outcome, const trial::Campaign& campaign, const std::filesystem::path& folder);

// Coordinates of these parameters as a fit.json holds them. Nothing where it rests on another input (input_of): other
// recordings, another drag law or simulator, another version of the code. Throws BadInput where it is no fit/1.
std::optional<Eigen::VectorXd> read_fit(const std::filesystem::path& file, const std::string& input,
                                        const std::vector<model::Parameter>& parameters);

}  // namespace selvedge::fit
