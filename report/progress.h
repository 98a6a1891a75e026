// Progress of long work, with the time left.
#pragma once

#include <functional>
#include <string>

namespace selvedge::report {

// Long work calls it now and then. done: 0 to 1. what: the step, with the best figure so far if any.
using ProgressCallback = std::function<void(double done, const std::string& what)>;

// One line on standard error, rewritten in place on a terminal, a line every few seconds elsewhere, with
// elapsed time and an estimate of the time left.
ProgressCallback terminal_progress(const std::string& title);

}  // namespace selvedge::report
