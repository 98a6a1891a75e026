// Processor time of this thread, s: other work on the machine does not count.
#pragma once

#include <ctime>

namespace selvedge::cli {

inline double thread_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace selvedge::cli
