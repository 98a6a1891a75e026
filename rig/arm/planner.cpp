#include "rig/arm/planner.h"

#include <sys/resource.h>

#include <spdlog/spdlog.h>

namespace selvedge::arm {

namespace {
constexpr int kNice = 10;
}

Planner::~Planner() {
  {
    const std::lock_guard lock(mutex_);
    given_up_.request_stop();
  }
  thread_.request_stop();
  changed_.notify_all();
}

void Planner::start(Job job) {
  {
    const std::lock_guard lock(mutex_);
    given_up_.request_stop();
    given_up_ = std::stop_source();
    job_ = std::move(job);
    outcome_.reset();
  }
  changed_.notify_all();
}

std::optional<Planner::Outcome> Planner::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(outcome_, std::nullopt);
}

void Planner::run(const std::stop_token& ending) {
  ::setpriority(PRIO_PROCESS, 0, kNice);  // of this thread alone, on Linux
  while (true) {
    Job job;
    std::stop_token given_up;
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, ending, [this] { return job_.has_value(); })) return;
      job = std::move(*job_);
      job_.reset();
      given_up = given_up_.get_token();
    }
    Outcome outcome{job.trajectory_id, nullptr, ""};
    try {
      outcome.path = std::make_shared<const JointPath>(plan(model_, job.start_rad, job.path, job.limits, given_up));
    } catch (const Cancelled&) { continue; } catch (const std::exception& error) {
      spdlog::warn("arm: trajectory {} refused: {}", job.trajectory_id, error.what());
      outcome.refused = error.what();
    }
    const std::lock_guard lock(mutex_);
    if (!given_up.stop_requested()) outcome_ = std::move(outcome);
  }
}

}  // namespace selvedge::arm
