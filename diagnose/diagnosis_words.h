// Numbers of a diagnosis in words, for its page and the terminal. What cannot be told is said to be so.
#pragma once

#include <string>

#include "diagnose/diagnosis.h"

namespace selvedge::diagnose {

// "the camera's clock is late by 6.6 ms (5.0 to 8.2)", "gap 1.2 mm (0.9 to 1.6)".
std::string in_words(const SizedParameter& size);
std::string in_words(const std::vector<SizedParameter>& parameters);
// How large an effect may be that is not named: "du -1.2 to 3.9 mm; dv …"; "any" where data do not show it.
std::string unseen_in_words(const EffectFinding& effect);

// " (90 %: 0.40 to 0.65 mm)"; nothing where there is none.
std::string interval_in_words(double low_mm, double high_mm, int decimals);

// Two sentences: how large the gap is and how sure that is, and whether a right model would leave as much.
std::string gap_in_words(const Diagnosis& d);

// A motion that is forecast for so long: "waving-1 at 1.2 times its speed, the first 1.2 s of motion"; without that
// where it is not finite.
std::string motion_in_words(const std::string& motion, double moving_s);

// How likely it is that nothing, or nothing known, is amiss.
std::string no_effect_in_words(const Diagnosis& d);

// "3.59 → 1.64" and "0.64 (0.55 … 0.79)", for tables; no interval where there is none.
std::string before_and_after(const GapReduction& reduction);
// Its name, and the effects that it was looked at together with: "smoothing, with draught".
std::string name_in_words(const EffectFinding& effect);
std::string share_closed(const GapReduction& reduction);

}  // namespace selvedge::diagnose
