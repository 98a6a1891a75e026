// Ctrl-C and SIGTERM for commands that run until they are told to stop.
#pragma once

#include <atomic>

namespace selvedge::cli {

// From now on SIGINT, SIGTERM and SIGHUP set the flag returned.
const std::atomic<bool>& stop_on_signals();

}  // namespace selvedge::cli
