// Every effect that a diagnosis can name: one a file of this folder. The table is made by the build from the files
// that are there, so that an effect is added or taken away with its file.
#pragma once

#include <vector>

#include "diagnose/effects/effect.h"

namespace selvedge::diagnose {

// In alphabetical order of their names.
const std::vector<Effect>& effect_library();

}  // namespace selvedge::diagnose
