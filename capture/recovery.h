// What a recorder that went away, or a disk that lost something, left of a trial; and mending it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/trial/trial.h"

namespace selvedge::capture {

struct Recovery {
  bool mended = false;            // something was written
  std::vector<std::string> done;  // what was mended, a sentence each
  trial::Trial trial;             // as it reads now; its `damaged` names every gap
};

// Mends what can be mended and reads the trial. A trial that says "recording" becomes "cut": torn and damaged lines,
// damaged images and unlisted ones go out of it (what was damaged stays beside it as NAME.damaged), gaps are listed. A
// trial.json that does not read is put back from its copy, a copy from it. Of a trial that has ended, nothing else is
// touched. Throws BadInput where it is no trial, is still being recorded, or trial.json cannot be had.
Recovery recover(const std::filesystem::path& trial_folder);

// Trials of a folder: itself where it is one; or those below it, in the order of their names. Throws BadInput where
// there are none.
std::vector<std::filesystem::path> trials_at(const std::filesystem::path& folder);

}  // namespace selvedge::capture
