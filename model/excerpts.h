// The pieces of long recordings that are looked at: of markers where the held edge moves most, of pictures where it
// begins to move.
//
// What hung cloth does is soon forgotten, so a piece may begin anywhere that markers can hold it to, and a campaign of
// any length costs the same. Pictures hold nothing: their pieces begin at rest, and end before errors have grown large.
#pragma once

#include <vector>

#include "model/observed_trial.h"

namespace selvedge::model {

struct ExcerptOptions {
  double most_motion_s = 12;  // of all pieces together, their leads apart
  double lead_s = 0.5;        // of each piece, from where it begins; that does not count
  double delay_s = 0;         // of the markers' stamps
  bool pictures = false;      // whether trials of pictures are cut, too
};

// Of trials that together move for longer than most_motion_s: one piece of each, as much of each as of the others;
// those of markers with ObservedTrial::lead_s and ObservedTrial::before. Trials that are not cut as they are.
std::vector<ObservedTrial> excerpts(std::vector<ObservedTrial> trials, const ExcerptOptions& options);

// Markers within the leads left out: what remains is simulated from where the piece begins, and all of it counts.
std::vector<ObservedTrial> without_leads(std::vector<ObservedTrial> trials);

// What was seen until then. Of a trial that is still all of it.
ObservedTrial beginning_of(ObservedTrial trial, double until_s);

// Of all that moves, s.
double motion_s(const std::vector<ObservedTrial>& trials);

}  // namespace selvedge::model
