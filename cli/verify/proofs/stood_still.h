// How long this machine let a proof wait: clocks that are watched for seconds cannot be judged where it stands still
// for a good part of them.
#pragma once

#include <atomic>
#include <chrono>
#include <thread>

namespace selvedge::cli {

class StoodStill {
 public:
  double longest_s() const { return longest_s_; }

 private:
  static constexpr std::chrono::milliseconds kRest{10};

  void watch(const std::stop_token& stopping) {
    while (!stopping.stop_requested()) {
      const auto asleep = std::chrono::steady_clock::now();
      std::this_thread::sleep_for(kRest);
      const std::chrono::duration<double> late = std::chrono::steady_clock::now() - asleep - kRest;
      if (late.count() > longest_s_) longest_s_ = late.count();
    }
  }

  std::atomic<double> longest_s_{0};
  std::jthread watcher_{[this](const std::stop_token& stopping) { watch(stopping); }};
};

}  // namespace selvedge::cli
