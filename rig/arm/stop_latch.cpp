#include "rig/arm/stop_latch.h"

#include <spdlog/spdlog.h>

#include "files/durable.h"
#include "files/whole_file.h"
#include "rig/clock.h"

namespace selvedge::arm {

StopLatch::StopLatch(std::filesystem::path file) : file_(std::move(file)) {
  // Not what a link leads to, and no permission to look is no "not there".
  std::error_code error;
  if (std::filesystem::symlink_status(file_, error).type() == std::filesystem::file_type::not_found) return;
  try {
    left_behind_ = files::read_whole(file_);
  } catch (const std::exception& unreadable) {
    left_behind_ = std::string("the kept stop cannot be read: ") + unreadable.what();
  }
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

std::string StopLatch::settle() {
  std::optional<std::string> wanted;
  {
    const std::lock_guard lock(mutex_);
    if (wanted_ == written_) return "";
    wanted = wanted_;
  }
  std::string failed;
  try {
    if (wanted) {
      files::write_whole(file_, *wanted);
    } else {
      std::filesystem::remove(file_);
      files::sync_folder(files::folder_of(file_));
    }
    const std::lock_guard lock(mutex_);
    written_ = wanted;
  } catch (const std::exception& error) { failed = error.what(); }
  if (failed != logged_ && !failed.empty())
    spdlog::error("arm: {} could not be kept for a restart: {}", wanted ? "the stop that holds" : "a reset", failed);
  logged_ = failed;
  return wanted ? failed : "";
}

}  // namespace selvedge::arm
