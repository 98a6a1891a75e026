// What a trial holds, in words: for `check` and for the page of what was imported.
#pragma once

#include <string>
#include <vector>

#include "capture/trial/trial.h"

namespace selvedge::station {

// Rows of two cells: what, and how much of it.
std::vector<std::vector<std::string>> facts_of(const trial::Trial& trial);

std::string percent_of(double share);
std::string fabric_in_words(const trial::Trial& trial);
std::string noise_in_words(const trial::Trial& trial);
std::string seen_by(const geometry::Projection& projection);
// What it is made of, and its numbers: two cells.
std::vector<std::string> material_test_in_words(const trial::Trial& trial);

}  // namespace selvedge::station
