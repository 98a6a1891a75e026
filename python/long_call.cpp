#include "python/long_call.h"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <thread>

namespace selvedge::python {

namespace py = pybind11;

LongCall::LongCall(const std::string& title, const py::object& progress, std::shared_ptr<std::atomic<bool>> stop)
    : told_(progress), stop_(std::move(stop)) {
  if (progress.is_none()) told_ = py::module_::import("selvedge._progress").attr("Line")(title);
  else if (py::isinstance<py::bool_>(progress)) told_ = py::none();
}

report::ProgressCallback LongCall::progress() {
  return [this](double done, const std::string& what) {
    cloth::throw_if_stopped(stop_);
    const std::lock_guard lock(mutex_);
    last_ = {done, what};
  };
}

void LongCall::deliver() {
  std::optional<std::pair<double, std::string>> told;
  {
    const std::lock_guard lock(mutex_);
    std::swap(told, last_);
  }
  if (told && !told_.is_none()) told_(told->first, told->second);
}

void LongCall::run(const std::function<void()>& work) {
  std::condition_variable has_ended;
  bool ended = false;
  std::exception_ptr failed, stopped_by;
  std::thread worker([&] {
    try {
      work();
    } catch (...) { failed = std::current_exception(); }
    const std::lock_guard lock(mutex_);
    ended = true;
    has_ended.notify_one();
  });
  for (bool done = false; !done;) {
    {
      const py::gil_scoped_release others_may_run;
      std::unique_lock lock(mutex_);
      has_ended.wait_for(lock, std::chrono::milliseconds(100), [&] { return ended; });
      done = ended;
    }
    if (stopped_by) continue;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      deliver();
    } catch (...) {
      stopped_by = std::current_exception();
      stop_->store(true);
    }
  }
  worker.join();
  stop_->store(false);
  if (stopped_by) std::rethrow_exception(stopped_by);
  if (failed) std::rethrow_exception(failed);
}

}  // namespace selvedge::python
