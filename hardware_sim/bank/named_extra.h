// What a simulated fabric can have beyond its base, by name: the hidden effects that no diagnosis has in its library
// (hardware_sim/hidden_effects/), and the library's own in another form (fabric_extras.h).
#pragma once

#include <string>

#include "hardware_sim/bank/fabric_extras.h"

namespace selvedge::hardware_sim {

// size: of a hidden effect 1 is as plain as the library's of usual size; else in the effect's unit, see
// fabric_extras.cpp. Throws BadInput, starting with `where`, for a name that is none of these.
Extra named_extra(const std::string& name, double size, const std::string& where);

}  // namespace selvedge::hardware_sim
