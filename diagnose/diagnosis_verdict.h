// What a diagnosis is worth, in one sentence.
//
// Not to be believed: what was recorded is doubted. With care: no cause is named though there is a gap; the cause, or
// that there is none, is likely by less than 0.8; the cause takes less than half of the gap; others are not told apart
// from it; trials vary so much that a gap is not sure (p above 0.05).
#pragma once

#include "diagnose/diagnosis.h"
#include "report/verdict.h"

namespace selvedge::diagnose {

report::Verdict verdict_of(const Diagnosis& diagnosis);

}  // namespace selvedge::diagnose
