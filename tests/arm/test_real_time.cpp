// What the control loop's log says of its priority and memory is what the kernel gave.
#include "rig/arm/real_time.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <string>

namespace selvedge::arm {
namespace {

long locked_kib() {
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key;)
    if (long kib = 0; key == "VmLck:" && status >> kib) return kib;
  return -1;
}

// 0 where the words are true.
int ask_in_a_child(void (*before)()) {
  const pid_t child = ::fork();
  if (child == 0) {
    before();
    const std::string said = ask_for_real_time();
    const bool first = said.starts_with("real-time priority 40"), locked = said.ends_with(", memory locked");
    const bool says_why = first || said.starts_with("no real-time priority (");
    sched_param got{};
    ::sched_getparam(0, &got);
    const bool is_first = ::sched_getscheduler(0) == SCHED_FIFO && got.sched_priority == 40;
    // Locked on fault: what the process touches from then on.
    std::string touched(1 << 20, 'x');
    const bool is_locked = locked_kib() > 0 && touched.back() == 'x';
    ::_exit((first == is_first ? 0 : 1) + (locked == is_locked ? 0 : 2) + (says_why ? 0 : 4));
  }
  int ended = -1;
  ::waitpid(child, &ended, 0);
  return WIFEXITED(ended) ? WEXITSTATUS(ended) : -1;
}

TEST(RealTime, SaysWhatItGot) {
  EXPECT_EQ(ask_in_a_child([] {}), 0);
}

TEST(RealTime, SaysWhatItWasRefused) {
  EXPECT_EQ(ask_in_a_child([] {
              const rlimit none{0, 0};
              ::setrlimit(RLIMIT_RTPRIO, &none);
              ::setrlimit(RLIMIT_MEMLOCK, &none);
              if (::geteuid() == 0 && ::setuid(65534) != 0) ::_exit(8);
            }),
            0);
}

}  // namespace
}  // namespace selvedge::arm
