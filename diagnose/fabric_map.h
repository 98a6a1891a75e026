// A picture of the flat fabric with the residual painted at each marker.
#pragma once

#include <string>

#include "diagnose/where.h"

namespace selvedge::diagnose {

// SVG: a disc a marker, its area and shade by the error, the error beside it in mm.
std::string fabric_map(const ResidualMap& map);

}  // namespace selvedge::diagnose
