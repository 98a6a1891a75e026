// The pieces of long recordings that are looked at: where the held edge moves most.
//
// Windows (windows.h) forget how the sheet came to where it is, so they may begin anywhere, and a campaign of any
// length costs the same.
#pragma once

#include <vector>

#include "diagnose/protocol.h"
#include "model/observed_trial.h"

namespace selvedge::diagnose {

// Of trials with markers that together move for longer than Protocol::most_motion_s: one piece of each, as much of each
// as of the others. It begins as if it had hung there, so its first Protocol::lead_s do not count
// (ObservedTrial::lead_s). delay_s: of the markers' stamps.
std::vector<model::ObservedTrial> excerpts(std::vector<model::ObservedTrial> trials, double delay_s,
                                           const Protocol& protocol);

}  // namespace selvedge::diagnose
