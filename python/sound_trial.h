// Trials that Python made: whether their parts fit together, before anything counts on it.
#pragma once

#include "capture/trial/trial.h"

namespace selvedge::python {

// Throws BadInput naming the attribute where arrays are not of one length, times go backwards, or the fabric has no
// size or mass.
void expect_sound(const trial::Trial& trial);
void expect_sound(const trial::Campaign& campaign);

}  // namespace selvedge::python
