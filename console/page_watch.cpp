#include "console/page_watch.h"

#include <fmt/format.h>

namespace selvedge::console {

PageWatch::PageWatch(RigLink& link, double bound_s, std::function<void(const std::string&)> on_stop)
    : link_(link), bound_(bound_s), on_stop_(std::move(on_stop)), thread_([this] { run(); }) {}

PageWatch::~PageWatch() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void PageWatch::heard(const std::string& page) {
  const std::lock_guard lock(mutex_);
  if (!page_.empty() && page == page_) heard_ = Clock::now();
}

void PageWatch::armed_by(const std::string& page) {
  const std::lock_guard lock(mutex_);
  page_ = page;
  heard_ = Clock::now();
}

void PageWatch::disarmed() {
  const std::lock_guard lock(mutex_);
  page_.clear();
}

bool PageWatch::waits_for(const std::string& page) const {
  const std::lock_guard lock(mutex_);
  return page_ == page;
}

void PageWatch::run() {
  const auto look = std::chrono::duration_cast<Clock::duration>(bound_ / 10);
  std::unique_lock lock(mutex_);
  while (!ending_) {
    wake_.wait_for(lock, look, [this] { return ending_; });
    if (ending_ || page_.empty() || Clock::now() - heard_ < bound_) continue;
    page_.clear();
    lock.unlock();
    if (link_.armed_here()) {
      const std::string why =
          fmt::format("the page that armed the arm has not been heard for {:.1f} s", bound_.count());
      try {
        link_.stop(why);
        on_stop_(why);
      } catch (const std::exception& error) {
        on_stop_(fmt::format("{}, and the stop failed: {}", why,
                             error.what()));  // the lease ends with this process's silence
      }
    }
    lock.lock();
  }
}

}  // namespace selvedge::console
