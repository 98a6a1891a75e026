// How much larger or smaller than the campaign's the model error of each window is.
//
// Model error is not spread evenly: where cloth folds and snaps a window errs ten times as much as where it swings. One
// s for all would be that of the few worst windows, and these would decide what all others are fitted to.
// So each window has its own, λ s with ln λ ~ N(0, Protocol::window_sd²) (a hierarchical scale; Gelman et al. 2013, 5),
// the likeliest where all that may be there is there at once: what a candidate explains does not make a window err.
// It is found by expectation and maximisation, with all coordinates summed over (Dempster, Laird and Rubin 1977): a
// still window, whose few rows a hundred coordinates can meet, is not taken to be right for that.
// Windows of pictures keep a λ of 1: there are few, of hundreds of points each.
#pragma once

#include "diagnose/linearisation.h"

namespace selvedge::diagnose {

// The same model error with that of each window, at each s.
ModelError by_windows(const Study& study, const Windows& windows, const Linearisation& about, ModelError error);

}  // namespace selvedge::diagnose
