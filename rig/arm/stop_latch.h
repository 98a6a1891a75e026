// A stop that holds until a person resets it, over the end of the daemon that received it.
//
// Pulled from any thread, without waiting; the control loop takes it in its next cycle. What holds is kept in a file
// (stop_file in control_link.h): where the daemon is killed and started again, the stop still holds. `settle` brings
// the file up to date and on the disk, and is called before a stop is answered. Whatever lies at that file's place is a
// stop that holds, readable or not: only its absence says that nothing was stopped.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>

namespace selvedge::arm {

class StopLatch {
 public:
  struct Pulled {
    std::string why;
    double received_s = 0;  // host clock
  };

  explicit StopLatch(std::filesystem::path file);

  // What an earlier process left behind; none where no stop held.
  const std::optional<std::string>& left_behind() const { return left_behind_; }

  void pull(const std::string& why);
  // The first pull since the last call.
  std::optional<Pulled> take();
  // The control loop: what holds now, after this cycle; none: no stop holds.
  void hold(const std::optional<std::string>& why);
  // Not on the control loop: it waits for the disk. Why a stop that holds is not kept; "" where it is, or none holds.
  // Tried again at the next call.
  std::string settle();

 private:
  const std::filesystem::path file_;
  std::optional<std::string> left_behind_;
  std::mutex mutex_;  // guards the rest
  std::optional<Pulled> pulled_;
  std::optional<std::string> wanted_, written_;
  std::string logged_;  // settle's alone: the error that was logged last
};

}  // namespace selvedge::arm
