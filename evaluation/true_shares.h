// What each effect of a campaign truly takes of its gap: how much smaller the gap would be without it.
//
// Trials are recorded again with every subset of the effects; the base's parameters are found again for each, and what
// it leaves beyond the sensor's noise is the subset's gap. An effect's share is the mean over the orders in which
// effects may be added of what it adds (Shapley 1953), of the gap with all. What the base leaves without any is
// nobody's.
#pragma once

#include <functional>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "capture/trial/trial.h"

namespace selvedge::evaluation {

// Squared error of predictions a quarter of a second ahead (windows.h), mm², above the noise, of the base of a
// diagnosis refitted to these trials of markers. May be negative by chance.
double base_gap_mm2(const trial::Campaign& campaign, const nlohmann::json& diagnosis);

// Of `count` players the mean over orders of what each adds; worth: of a subset, bit k: player k is in it.
std::vector<double> shapley(size_t count, const std::function<double(unsigned)>& worth);

}  // namespace selvedge::evaluation
