// What a trial says that no hung swatch does: units, axes and clocks taken for others. Such a trial reads and can be
// fitted, and every answer from it is wrong.
//
// One sentence each: what was found, what was expected, and what is often the reason. Limits are wide: a fabric that
// stretches by a fifth, a swatch that is thrown up or a tracker that is a centimetre off raises no doubt.
#pragma once

#include <string>
#include <vector>

#include "capture/trial/trial.h"

namespace selvedge::trial {

// Of a fabric that hangs from a rig; of a material test none.
std::vector<std::string> doubts(const Trial& trial);

// Of all trials, each with its trial's name.
std::vector<std::string> doubts(const Campaign& campaign);

}  // namespace selvedge::trial
