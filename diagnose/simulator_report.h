// What a diagnosis says of another simulator (other_simulator.h): in words, as JSON, in its report.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "diagnose/other_simulator.h"
#include "report/html.h"

namespace selvedge::diagnose {

// How much our sheet leaves, behaving as it and put right, and what most of its gap is.
std::vector<std::string> lines_of(const SimulatorGap& gap);

// {"name", "is", "diverged", "before_mm", "after_mm", "imitated_mm", "parts": [{"part", "share", "interval",
// "alone_mm", "parameters": {NAME: {"simulator", "fabric", "unit"}}}, …], "unexplained": {"share", "interval"}}.
nlohmann::json to_json(const SimulatorGap& gap);

// Nothing where no simulator was given.
void add_simulator_gap(report::HtmlReport& html, const SimulatorGap& gap);

}  // namespace selvedge::diagnose
