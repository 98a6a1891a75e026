// Pictures of where on the flat fabric the held-out error lies: SVG.
//
// Colour and size of a spot stand for mm on a scale that the caller gives and the picture shows: pictures that are to
// be compared are drawn on one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "diagnose/where.h"

namespace selvedge::diagnose {

// The end of a scale that holds all of these, mm: 1, 2 or 5 times a power of ten.
double scale_end_mm(const std::vector<const std::vector<double>*>& errors_mm);

// at_mm: of each spot of the map; name: what a reader who does not see it is told.
std::string fabric_map(const ResidualMap& map, const std::vector<double>& at_mm, double scale_end_mm,
                       const std::string& name);

// "two corners are held", "the top edge is held"; "held by two corners or by the top edge, as the trials say".
std::string held_in_words(const ResidualMap& map);

// The key "map" of diagnosis.json: {"size_m", "held", "uv_m", "mm", "after_mm"}; what it reads back lacks the rest.
nlohmann::json map_to_json(const ResidualMap& map);
// Nothing where it is no such thing, or has no spots.
std::optional<ResidualMap> read_map(const nlohmann::json& value);

}  // namespace selvedge::diagnose
