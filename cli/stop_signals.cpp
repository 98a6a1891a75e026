#include "cli/stop_signals.h"

#include <csignal>

namespace selvedge::cli {

namespace {

std::atomic<bool> told_to_stop{false};
static_assert(std::atomic<bool>::is_always_lock_free);  // set by a signal handler

}  // namespace

const std::atomic<bool>& stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { told_to_stop = true; };
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) ::sigaction(signal, &action, nullptr);
  return told_to_stop;
}

}  // namespace selvedge::cli
