// Ending long work early: whoever started it keeps the flag and sets it, what simulates sees that at its next step and
// throws Stopped.
#pragma once

#include <atomic>
#include <memory>
#include <stdexcept>

namespace selvedge::cloth {

using StopFlag = std::shared_ptr<const std::atomic<bool>>;  // null: nobody stops it

struct Stopped : std::runtime_error {
  Stopped() : std::runtime_error("stopped") {}
};

inline void throw_if_stopped(const StopFlag& stop) {
  if (stop && stop->load(std::memory_order_relaxed)) throw Stopped();
}

}  // namespace selvedge::cloth
