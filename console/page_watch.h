// Stops the arm when the page that armed it is lost: closed, asleep, or cut off from the network.
//
// A page says that it is there every half second. The one that armed must be heard within the bound; else the arm is
// stopped, and what records is given up. Pages that only look may come and go.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "console/rig_link.h"

namespace selvedge::console {

class PageWatch {
 public:
  // on_stop: told why, for the log.
  PageWatch(RigLink& link, double bound_s, std::function<void(const std::string&)> on_stop);
  ~PageWatch();
  PageWatch(const PageWatch&) = delete;
  PageWatch& operator=(const PageWatch&) = delete;

  // Every request of a page that carries the token.
  void heard(const std::string& page);
  // From now on this page must be heard.
  void armed_by(const std::string& page);
  void disarmed();
  // Whether this page is still waited for: false once it was given up.
  bool waits_for(const std::string& page) const;

 private:
  using Clock = std::chrono::steady_clock;
  void run();

  RigLink& link_;
  const std::chrono::duration<double> bound_;
  const std::function<void(const std::string&)> on_stop_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::string page_;  // that armed; empty: nobody has
  Clock::time_point heard_{};
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace selvedge::console
