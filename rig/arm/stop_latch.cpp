#include "rig/arm/stop_latch.h"

#include <spdlog/spdlog.h>

#include "files/whole_file.h"
#include "rig/clock.h"

namespace selvedge::arm {

StopLatch::StopLatch(std::filesystem::path file) : file_(std::move(file)) {
  if (!std::filesystem::exists(file_)) return;
  left_behind_ = files::read_whole(file_);
  wanted_ = written_ = left_behind_;
}

void StopLatch::pull(const std::string& why) {
  const std::lock_guard lock(mutex_);
  if (!pulled_) pulled_ = Pulled{why, rig::host_now_s()};
  if (!wanted_) wanted_ = why;
}

std::optional<StopLatch::Pulled> StopLatch::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(pulled_, std::nullopt);
}

void StopLatch::hold(const std::optional<std::string>& why) {
  const std::lock_guard lock(mutex_);
  // One that was pulled since the loop looked still holds.
  if (why.has_value() == wanted_.has_value() || (!why && pulled_)) return;
  wanted_ = why;
}

void StopLatch::settle() {
  std::optional<std::string> wanted;
  {
    const std::lock_guard lock(mutex_);
    if (wanted_ == written_) return;
    wanted = wanted_;
  }
  try {
    if (wanted) files::write_whole(file_, *wanted);
    else std::filesystem::remove(file_);
    const std::lock_guard lock(mutex_);
    written_ = wanted;
  } catch (const std::exception& error) {
    spdlog::error("arm: the stop that holds could not be kept for a restart: {}", error.what());
  }
}

}  // namespace selvedge::arm
