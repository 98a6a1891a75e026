#include "rig/arm/daemon.h"

#include <chrono>
#include <future>
#include <mutex>
#include <thread>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <selvedge_rig/corner_sample_t.hpp>
#include <selvedge_rig/device_status_t.hpp>
#include <spdlog/spdlog.h>

#include "files/bad_input.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include "rig/device_status.h"
#include "rig/wire/socket.h"

namespace selvedge::arm {

namespace {

using selvedge_rig::arm_command_t;
using selvedge_rig::arm_control_t;
using selvedge_rig::arm_status_t;
using selvedge_rig::arm_trajectory_t;
using selvedge_rig::corner_sample_t;
using selvedge_rig::device_status_t;

constexpr double kSampleTimeout_s = 0.05;  // the loop goes on without a sample, to watch the lease
constexpr double kSilence_s = 0.5;         // no sample for so long: the controller is lost

// Where the two corners were last seen, motion-capture frame, and when.
struct Corners {
  std::optional<Eigen::Vector3d> held_m, fixed_m;
  double seen_s = -1;  // host clock, both seen
};

// Messages from the bus thread to the control loop, in their order.
class Inbox {
 public:
  using Message = std::variant<arm_control_t, arm_command_t, arm_trajectory_t>;
  void push(Message message) {
    const std::lock_guard lock(mutex_);
    // A flood must not cost the stop in it, which comes last: the oldest go.
    if (messages_.size() >= 256) messages_.erase(messages_.begin());
    messages_.push_back(std::move(message));
  }
  void see(const corner_sample_t& sample, const ArmConfiguration& configuration) {
    const std::lock_guard lock(mutex_);
    bool held = false, fixed = false;
    for (size_t i = 0; i < sample.name.size(); ++i) {
      if (sample.occluded[i]) continue;
      const Eigen::Vector3d position_m(sample.x_m[i], sample.y_m[i], sample.z_m[i]);
      if (!position_m.allFinite()) continue;
      if (sample.name[i] == configuration.held_corner) corners_.held_m = position_m, held = true;
      if (sample.name[i] == configuration.fixed_corner) corners_.fixed_m = position_m, fixed = true;
    }
    if (held && fixed) corners_.seen_s = rig::host_now_s();
  }
  std::vector<Message> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(messages_, {});
  }
  Corners corners() const {
    const std::lock_guard lock(mutex_);
    return corners_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<Message> messages_;
  Corners corners_;
};

ToolPath to_path(const arm_trajectory_t& message) {
  ToolPath path;
  path.time_s = message.time_s;
  path.point_m.resize(3, message.points);
  for (int i = 0; i < message.points; ++i) {
    const auto k = static_cast<size_t>(i);
    path.point_m.col(i) << message.x_m[k], message.y_m[k], message.z_m[k];
  }
  return path;
}

class Daemon {
 public:
  Daemon(const ArmConfiguration& configuration, rig::Bus& bus, Inbox& inbox, const std::string& device)
      : configuration_(configuration),
        model_(ArmModel::read(configuration.model)),
        bus_(bus),
        inbox_(inbox),
        status_(bus, device),
        device_(device),
        guard_(model_, configuration.guard, 1 / configuration.controller.rate_hz) {
    configuration_.controller.joints = model_.joints();
    if (configuration_.backend == "rtde" && model_.joints() != 6)
      refuse(configuration_.model.string(), "{} joints, backend rtde drives arms of 6", model_.joints());
    spdlog::info("{}: model {}, {} joints", device, model_.name(), model_.joints());
  }

  void run(const std::atomic<bool>& stopping) {
    while (!stopping) {
      try {
        const auto arm = configuration_.backend == "rtde" ? connect_rtde(configuration_.controller) : connect_mxt(configuration_.controller);
        control(*arm, stopping);
      } catch (const std::runtime_error& error) {
        guard_.disconnected(error.what());
        status_.set_state(device_status_t::LOST, error.what());
      }
      for (int i = 0; i < 10 && !stopping; ++i) {
        handle_messages();
        status_.publish_if_due();
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
      publish(std::nullopt);
    }
    status_.set_state(device_status_t::STOPPED, "");
  }

 private:
  // The control loop: messages, watch, one set-point, state; the controller's beat sets the pace.
  void control(Arm& arm, const std::atomic<bool>& stopping) {
    std::optional<Eigen::VectorXd> set_point_rad;
    double sample_s = rig::host_now_s();
    while (!stopping) {
      const auto sample = arm.cycle(set_point_rad, kSampleTimeout_s);
      handle_messages();
      collect_plan();
      watch_corners();
      if (!sample) {
        if (rig::host_now_s() - sample_s > kSilence_s)
          throw wire::Disconnected(fmt::format("no sample from the controller for {} s", kSilence_s));
        continue;
      }
      sample_s = rig::host_now_s();
      set_point_rad = guard_.step(*sample, sample_s);
      last_sample_ = *sample;
      publish(sample);
      status_.delivered();
      status_.set_state(sample->ready ? device_status_t::RUNNING : device_status_t::DEGRADED, sample->not_ready);
      status_.publish_if_due();
    }
    arm.cycle(std::nullopt, kSampleTimeout_s);
  }

  void handle_messages() {
    for (const auto& message : inbox_.take()) {
      const double now_s = rig::host_now_s();
      if (const auto* control = std::get_if<arm_control_t>(&message)) {
        spdlog::info("{}: {} from {:x}: {}", device_, control->action == arm_control_t::STOP ? "stop" : control->action == arm_control_t::ARM ? "arm" : "disarm",
                     static_cast<uint64_t>(control->sender), control->reason);
        guard_.on_control(*control, now_s);
      } else if (const auto* command = std::get_if<arm_command_t>(&message)) {
        guard_.on_command(*command, now_s);
      } else if (const auto* trajectory = std::get_if<arm_trajectory_t>(&message)) {
        if (guard_.on_trajectory(*trajectory, now_s)) start_plan(*trajectory);
      }
    }
  }

  void start_plan(const arm_trajectory_t& trajectory) {
    planned_id_ = trajectory.trajectory_id;
    PlanLimits limits = configuration_.plan;
    if (configuration_.corner_distance_m > 0) {
      const Corners corners = inbox_.corners();
      if (corners.seen_s < rig::host_now_s() - configuration_.tracker_timeout_s)
        return guard_.plan_refused(planned_id_, "the tracker does not see both corners, so their distance cannot be checked");
      const Eigen::Isometry3d base_from_world = configuration_.world_from_base.inverse();
      limits.corners = CornerDistance{base_from_world * *corners.fixed_m,
                                      base_from_world * *corners.held_m - model_.base_from_tool(guard_.hold_rad()).translation(),
                                      configuration_.corner_distance_m};
    }
    plan_ = std::async(std::launch::async, [this, limits, start_rad = guard_.hold_rad(), path = to_path(trajectory)] {
      return plan(model_, start_rad, path, limits);
    });
  }

  void collect_plan() {
    if (!plan_.valid() || plan_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    try {
      guard_.plan_ready(planned_id_, plan_.get());
    } catch (const BadInput& error) {
      spdlog::warn("{}: trajectory {} refused: {}", device_, planned_id_, error.what());
      guard_.plan_refused(planned_id_, error.what());
    }
  }

  void watch_corners() {
    if (configuration_.tracker.empty() || !guard_.moving()) return;
    const Corners corners = inbox_.corners();
    const double silent_s = rig::host_now_s() - corners.seen_s;
    if (silent_s > configuration_.tracker_timeout_s)
      return guard_.stop(arm_status_t::STOP_TRACKER, fmt::format("both corners not seen for {:.2f} s", silent_s));
    const double apart_m = (*corners.held_m - *corners.fixed_m).norm();
    // Marker noise must not stop what the plan allows.
    if (configuration_.corner_distance_m > 0 && apart_m > configuration_.corner_distance_m + kMarkerSlack_m)
      guard_.stop(arm_status_t::STOP_LIMIT,
                  fmt::format("the corners are {:.4f} m apart, limit {:.4f} m", apart_m, configuration_.corner_distance_m));
  }

  void publish(const std::optional<ArmSample>& sample) {
    arm_status_t message{};
    guard_.fill(message);
    message.utime = sample ? std::llround(sample->time_s * 1e6) : rig::host_now_us();
    message.tool_wxyz[0] = 1;
    if (last_sample_) {
      const auto& [time_s, q, qd, ready, why, protective] = *last_sample_;
      const Eigen::VectorXd commanded = guard_.hold_rad().size() == q.size() ? guard_.hold_rad() : q;
      message.joints = static_cast<int32_t>(q.size());
      message.q_rad.assign(q.begin(), q.end());
      message.q_commanded_rad.assign(commanded.begin(), commanded.end());
      message.qd_rad_s.assign(qd.begin(), qd.end());
      const Eigen::Isometry3d pose = model_.base_from_tool(q);
      const Eigen::Quaterniond turn(pose.linear());
      const Eigen::Vector3d commanded_m = model_.base_from_tool(commanded).translation();
      for (int axis = 0; axis < 3; ++axis) {
        message.tool_m[axis] = pose.translation()[axis];
        message.tool_commanded_m[axis] = commanded_m[axis];
      }
      message.tool_wxyz[0] = turn.w();
      message.tool_wxyz[1] = turn.x();
      message.tool_wxyz[2] = turn.y();
      message.tool_wxyz[3] = turn.z();
    }
    bus_.publish(rig::channel(device_, rig::kArm), message);
    status_.set_refused(message.commands_refused);
    if (message.stop_text != said_) {
      said_ = message.stop_text;
      if (!said_.empty()) spdlog::warn("{}: stopped: {}", device_, said_);
    }
  }

  static constexpr double kMarkerSlack_m = 0.003;

  ArmConfiguration configuration_;
  const ArmModel model_;
  rig::Bus& bus_;
  Inbox& inbox_;
  rig::DeviceStatus status_;
  std::string device_;
  MotionGuard guard_;
  std::optional<ArmSample> last_sample_;
  std::future<JointPath> plan_;
  int64_t planned_id_ = 0;
  std::string said_;
};

}  // namespace

void run_daemon(const rig::Configuration& configuration, const std::atomic<bool>& stopping,
                const std::string& device) {
  const ArmConfiguration own = read_configuration(configuration.section(device));
  Inbox inbox;  // outlives the bus, whose thread fills it
  rig::Bus bus(configuration.bus());
  bus.subscribe<arm_control_t>(rig::channel(device, rig::kControl), [&](const auto& message) { inbox.push(message); });
  bus.subscribe<arm_command_t>(rig::channel(device, rig::kCommand), [&](const auto& message) { inbox.push(message); });
  bus.subscribe<arm_trajectory_t>(rig::channel(device, rig::kTrajectory), [&](const auto& message) { inbox.push(message); });
  if (!own.tracker.empty())
    bus.subscribe<corner_sample_t>(rig::channel(own.tracker, rig::kCorners), [&](const auto& sample) { inbox.see(sample, own); });
  Daemon daemon(own, bus, inbox, device);
  bus.start();
  daemon.run(stopping);
}

}  // namespace selvedge::arm
