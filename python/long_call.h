// Long work out of Python: on a thread of its own, without the interpreter's lock. Meanwhile the thread that called
// passes progress on and looks for Ctrl-C ten times a second; with either's error it stops the work, waits until that
// has ended, and lets the error go on. So no Python runs in the threads that compute.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include <pybind11/pybind11.h>

#include "cloth/stop.h"
#include "report/progress.h"

namespace selvedge::python {

class LongCall {
 public:
  // progress: what the caller gave. None: a line on sys.stderr that begins with `title`; False: nothing; else it is
  // called with the share done (0 to 1) and what is being done.
  // stop: the flag of what is called again and again; by default one of this call's own.
  LongCall(const std::string& title, const pybind11::object& progress,
           std::shared_ptr<std::atomic<bool>> stop = std::make_shared<std::atomic<bool>>(false));

  // For the work: it may throw what ends the work.
  report::ProgressCallback progress();
  cloth::StopFlag stop() const { return stop_; }

  void run(const std::function<void()>& work);

 private:
  void deliver();  // what was told last, to Python

  pybind11::object told_;
  std::shared_ptr<std::atomic<bool>> stop_;
  std::mutex mutex_;
  std::optional<std::pair<double, std::string>> last_;  // guarded by mutex_
};

// Work: a function that takes the LongCall; what it returns is returned.
template <class Work>
auto long_call(LongCall&& call, const Work& work) {
  std::optional<decltype(work(call))> result;
  call.run([&] { result.emplace(work(call)); });
  return std::move(*result);
}

}  // namespace selvedge::python
