// Every effect that a diagnosis can name: one a file of this folder. The table is made by the build from the files
// that are there, so that an effect is added or taken away with its file.
#pragma once

#include <string>
#include <vector>

#include "diagnose/effects/effect.h"

namespace selvedge::diagnose {

// In alphabetical order of their names.
const std::vector<Effect>& effect_library();

// Those of these names (none named: all) but for those left out. Throws BadInput, which says `where`, for a name that
// is none.
std::vector<Effect> chosen_effects(const std::vector<std::string>& names, const std::vector<std::string>& without,
                                   const std::string& where);

}  // namespace selvedge::diagnose
