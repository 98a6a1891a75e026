// Plans paths on a thread of its own, at a lower priority than the control loop, which never waits for it.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <Eigen/Core>

#include "rig/arm/plan.h"

namespace selvedge::arm {

class Planner {
 public:
  struct Job {
    int64_t trajectory_id = 0;
    Eigen::VectorXd start_rad;
    ToolPath path;
    PlanLimits limits;
  };
  struct Outcome {
    int64_t trajectory_id = 0;
    std::shared_ptr<const JointPath> path;  // none: refused
    std::string refused;
  };

  explicit Planner(const ArmModel& model)
      : model_(model), thread_([this](const std::stop_token& ending) { run(ending); }) {}
  ~Planner();
  Planner(const Planner&) = delete;
  Planner& operator=(const Planner&) = delete;

  // A job that runs or waits is given up for this one.
  void start(Job job);
  // Once for each job that came to its end.
  std::optional<Outcome> take();

 private:
  void run(const std::stop_token& ending);

  const ArmModel& model_;
  std::mutex mutex_;  // guards down to given_up_
  std::condition_variable_any changed_;
  std::optional<Job> job_;
  std::optional<Outcome> outcome_;
  std::stop_source given_up_;
  std::jthread thread_;
};

}  // namespace selvedge::arm
