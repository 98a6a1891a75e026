// What the bank's fabrics can have beyond their base in the worlds of points (sheets/point_sheet.h): the names of
// fabric_extras.h, in other forms than there. Friction is of two sliders, a weight is a point's, a hem fades away from
// the rim.
#pragma once

#include <string>

#include "hardware_sim/sheets/point_sheet.h"

namespace selvedge::hardware_sim {

// size: as fabric_extra's. False where the name is none that these worlds have in a form of their own.
bool add_point_extra(PointSheet& sheet, const std::string& name, double size);

}  // namespace selvedge::hardware_sim
