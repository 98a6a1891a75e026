// What a comparison is worth, in one sentence: which of two results predicts better what it was not fitted to, by how
// much, or that the data can show no difference.
//
// One is better where its pooled held-out error is smaller and the 90 % intervals of at least one trial lie apart in
// its favour and of none in the other's; without fits, where the intervals of the gaps lie apart. Not to be believed: a
// fit or diagnosis that is not, a rigid plate that does as well as either. With care: what either is to be taken with,
// errors without intervals, errors that are not measured alike or not of the same trials, nothing held out.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "report/verdict.h"

namespace selvedge::station {

// pair: one of compare.json's, read by its numbers. "a", "b", "neither" or, where nothing says, null.
nlohmann::json better_of(const nlohmann::json& pair);

report::Verdict verdict_of_pair(const nlohmann::json& pair);

// pairs: with "better" and "verdict". One alone has its own verdict; of several, how many each side wins, trusted as
// far as the least of them.
report::Verdict verdict_of_pairs(const nlohmann::json& pairs);

}  // namespace selvedge::station
