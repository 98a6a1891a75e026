// What a result that is kept for later rests on. It is taken up again only where all of this is the same.
#pragma once

#include <string>

#include "capture/trial/trial.h"

namespace selvedge::estimate {

// SHA-256, hexadecimal, of the sources that numbers come from.
const char* code_version();

// SHA-256, hexadecimal, of what was recorded: each file that a trial is read from, pictures too, and which trials are
// replicates. Throws BadInput where a file cannot be read.
std::string recordings_hash(const trial::Campaign& campaign);

// SHA-256, hexadecimal, of recordings (their hash), settings (text) and code.
std::string input_hash(const std::string& recordings, const std::string& settings);

}  // namespace selvedge::estimate
