// What a fit is worth, in one sentence.
//
// Not to be believed: what was recorded is doubted (capture/trial/doubts.h); trials that the fit did not see are
// predicted no better than by a rigid plate, or missed by a tenth of the swatch; half of the parameters end at their
// bounds; nothing at all was held out or compared. With care: a parameter at a bound, more than half undetermined, what
// was not seen missed by more than twice what was fitted, a grid that leaves more than 1 mm open.
#pragma once

#include "fit/fit_outcome.h"
#include "report/verdict.h"

namespace selvedge::fit {

report::Verdict verdict_of(const FitOutcome& outcome);

}  // namespace selvedge::fit
