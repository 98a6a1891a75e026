// Processor time of the child processes that have ended and were waited for, user and system together, s.
#pragma once

#include <sys/resource.h>

namespace selvedge::cli {

inline double children_cpu_s() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace selvedge::cli
