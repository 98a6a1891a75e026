#include "rig/arm/real_time.h"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstring>

#include <fmt/format.h>

namespace selvedge::arm {

namespace {
constexpr int kPriority = 40;  // above ordinary threads, below the kernel's own (50)
}

std::string ask_for_real_time() {
  sched_param wanted{};
  wanted.sched_priority = kPriority;
  const int refused = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &wanted);
  const std::string priority = refused == 0 ? fmt::format("real-time priority {}", kPriority)
                                            : fmt::format("no real-time priority ({}; LimitRTPRIO={} allows it)",
                                                          std::strerror(refused), kPriority);
  // On fault: what is never touched takes no memory.
  const bool locked = ::mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0;
  return priority +
         (locked ? ", memory locked"
                 : fmt::format(", memory not locked ({}; LimitMEMLOCK=infinity allows it)", std::strerror(errno)));
}

}  // namespace selvedge::arm
