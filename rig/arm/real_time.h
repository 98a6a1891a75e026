// Real-time priority and locked memory for the calling thread, where the system allows them.
#pragma once

#include <string>

namespace selvedge::arm {

// What was had and what was not, for the log: "real-time priority 40, memory locked".
std::string ask_for_real_time();

}  // namespace selvedge::arm
