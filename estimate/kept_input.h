// What a result that is kept for later rests on. It is taken up again only where all of this is the same.
#pragma once

#include <string>

#include "capture/trial/trial.h"

namespace selvedge::estimate {

// SHA-256, hexadecimal, of the sources that numbers come from.
const char* code_version();

// SHA-256, hexadecimal, of the campaign (each file of each trial, pictures too, and which trials are replicates), of
// the settings (text), and of the code. Throws BadInput where a file cannot be read.
std::string input_hash(const trial::Campaign& campaign, const std::string& settings);

}  // namespace selvedge::estimate
