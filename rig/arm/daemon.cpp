#include "rig/arm/daemon.h"

#include <pwd.h>
#include <unistd.h>

#include <chrono>
#include <mutex>
#include <thread>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <selvedge_rig/corner_sample_t.hpp>
#include <selvedge_rig/device_status_t.hpp>
#include <spdlog/spdlog.h>

#include "files/bad_input.h"
#include "rig/arm/control_server.h"
#include "rig/arm/planner.h"
#include "rig/arm/real_time.h"
#include "rig/arm/stop_latch.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include "rig/device_status.h"
#include "rig/wire/socket.h"

namespace selvedge::arm {

namespace {

using selvedge_rig::arm_command_t;
using selvedge_rig::arm_control_t;
using selvedge_rig::arm_status_t;
using selvedge_rig::corner_sample_t;
using selvedge_rig::device_status_t;

constexpr double kSilence_s = 0.5;  // no sample for so long: the controller is lost
constexpr double kReconnect_s = 0.5;
constexpr double kIdle_s = 0.01;    // between looks at the messages while there is no controller
constexpr double kStatus_s = 0.05;  // the longest silence on the bus

// The tracker's newest samples, from the bus's thread to the control loop.
class Samples {
 public:
  void push(const corner_sample_t& sample) {
    const std::lock_guard lock(mutex_);
    if (samples_.size() < kMost) samples_.push_back(sample);
  }
  std::vector<corner_sample_t> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(samples_, {});
  }

 private:
  static constexpr size_t kMost = 256;
  std::mutex mutex_;
  std::vector<corner_sample_t> samples_;
};

// The daemon's own user, root, and those that the configuration names.
std::vector<uid_t> users_of(const ArmConfiguration& configuration) {
  std::vector<uid_t> users = {::geteuid(), 0};
  for (const std::string& name : configuration.control_users) {
    const passwd* entry = ::getpwnam(name.c_str());
    if (entry == nullptr) refuse("[arm] control_users", "found \"{}\", expected users of this host", name);
    users.push_back(entry->pw_uid);
  }
  return users;
}

const char* name_of(int8_t action) {
  return action == arm_control_t::ARM      ? "arm"
         : action == arm_control_t::DISARM ? "disarm"
         : action == arm_control_t::RESET  ? "reset"
                                           : "unknown";
}

class Daemon {
 public:
  Daemon(const ArmConfiguration& configuration, const std::filesystem::path& socket,
         const std::filesystem::path& stop_file, rig::Bus& bus, Samples& samples, const std::string& device)
      : configuration_(configuration), model_(ArmModel::read(configuration.model)), bus_(bus), samples_(samples),
        status_(bus, device), device_(device), tracker_(configuration.corners),
        guard_(model_, configuration.guard, 1 / configuration.controller.rate_hz, rig::host_now_us()), planner_(model_),
        latch_(stop_file), server_(
                               socket, users_of(configuration), [this](const std::string& why) { latch_.pull(why); },
                               [this] { return latch_.settle(); }) {
    configuration_.controller.joints = model_.joints();
    if (configuration_.backend == "rtde" && model_.joints() != 6)
      refuse(configuration_.model.string(), "{} joints, backend rtde drives arms of 6", model_.joints());
    spdlog::info("{}: model {}, {} joints, control at {}", device, model_.name(), model_.joints(), socket.string());
    if (latch_.left_behind())
      guard_.latch(arm_status_t::STOP_OPERATOR, "before the daemon was started again: " + *latch_.left_behind(),
                   rig::host_now_s());
  }

  void run(const std::atomic<bool>& stopping) {
    spdlog::info("{}: control loop: {}", device_, ask_for_real_time());
    while (!stopping) {
      try {
        const auto arm = configuration_.backend == "rtde" ? connect_rtde(configuration_.controller)
                                                          : connect_mxt(configuration_.controller);
        control(*arm, stopping);
      } catch (const std::runtime_error& error) {
        guard_.disconnected(error.what());
        status_.set_state(device_status_t::LOST, error.what());
      }
      for (const double until_s = rig::host_now_s() + kReconnect_s; !stopping && rig::host_now_s() < until_s;) {
        obey(rig::host_now_s());
        publish(std::nullopt);
        status_.publish_if_due();
        std::this_thread::sleep_for(std::chrono::duration<double>(kIdle_s));
      }
    }
    status_.set_state(device_status_t::STOPPED, "");
  }

 private:
  // The control loop: stop, messages, watch, one set-point, state. The controller's beat sets the pace; where it
  // sends nothing, a period of ours does.
  void control(Arm& arm, const std::atomic<bool>& stopping) {
    std::optional<Eigen::VectorXd> set_point_rad;
    double sample_s = rig::host_now_s();
    while (!stopping) {
      const auto sample = arm.cycle(set_point_rad, arm.period_s());
      const double now_s = rig::host_now_s();
      if (sample) last_sample_ = *sample, sample_s = now_s;
      if (now_s - sample_s > kSilence_s)
        throw wire::Disconnected(fmt::format("no sample from the controller for {} s", kSilence_s));
      obey(now_s);
      watch_corners(now_s);
      set_point_rad = guard_.step(sample, now_s);
      latch_.hold(guard_.latched() ? std::optional(guard_.stop_text()) : std::nullopt);
      publish(sample);
      if (sample) {
        status_.delivered();
        status_.set_state(sample->ready ? device_status_t::RUNNING : device_status_t::DEGRADED, sample->not_ready);
      }
      status_.publish_if_due();
    }
    arm.cycle(std::nullopt, arm.period_s());
  }

  // The stop first, then what came over the connections, then what the planner has done.
  void obey(double now_s) {
    if (const auto pulled = latch_.take()) guard_.latch(arm_status_t::STOP_OPERATOR, pulled->why, pulled->received_s);
    for (const corner_sample_t& sample : samples_.take()) tracker_.see(sample, now_s);
    for (const ControlServer::Message& message : server_.take())
      std::visit([&](const auto& what) { handle(message.sender, what, now_s); }, message.what);
    if (const auto outcome = planner_.take()) {
      if (outcome->path) guard_.plan_ready(outcome->trajectory_id, outcome->path);
      else guard_.plan_refused(outcome->trajectory_id, outcome->refused);
    }
    latch_.hold(guard_.latched() ? std::optional(guard_.stop_text()) : std::nullopt);
  }

  void handle(int64_t sender, const arm_control_t& control, double now_s) {
    const std::string refused = guard_.on_control(control, now_s);
    spdlog::info("{}: {} from {:x}: {}{}", device_, name_of(control.action), static_cast<uint64_t>(sender),
                 control.reason, refused.empty() ? "" : "; refused: " + refused);
    server_.answer(sender, control.sequence, refused);
  }
  void handle(int64_t, const arm_command_t& command, double now_s) {
    const bool moved = guard_.moving();
    guard_.on_command(command, now_s);
    if (!moved && guard_.moving()) tracker_.begin(tool_m(), now_s);
  }
  void handle(int64_t sender, const ControlServer::Path& path, double now_s) {
    const std::string refused = guard_.on_trajectory(sender, path.trajectory_id, path.utime, now_s);
    server_.answer(sender, path.sequence, refused);
    if (refused.empty()) start_plan(path, now_s);
  }
  void handle(int64_t sender, const ControlServer::Closed&, double) { guard_.on_closed(sender); }

  void start_plan(const ControlServer::Path& path, double now_s) {
    PlanLimits limits = configuration_.plan;
    if (configuration_.corners.corner_distance_m > 0) {
      const auto corners = tracker_.corners(now_s);
      if (!corners)
        return guard_.plan_refused(path.trajectory_id,
                                   "the tracker does not see both corners, so their distance cannot be checked");
      const Eigen::Isometry3d base_from_world = configuration_.world_from_base.inverse();
      limits.corners =
          CornerDistance{base_from_world * corners->fixed_m,
                         base_from_world * corners->held_m - model_.base_from_tool(guard_.hold_rad()).translation(),
                         configuration_.corners.corner_distance_m};
    }
    planner_.start({path.trajectory_id, guard_.hold_rad(), path.tool, limits});
  }

  Eigen::Vector3d tool_m() const {
    return last_sample_ ? Eigen::Vector3d(model_.base_from_tool(last_sample_->q_rad).translation())
                        : Eigen::Vector3d::Zero();
  }

  void watch_corners(double now_s) {
    if (configuration_.tracker.empty() || !guard_.moving()) return;
    if (const auto fault = tracker_.fault(tool_m(), now_s)) guard_.stop(fault->first, fault->second);
  }

  // A measurement a message; without one the bus hears of the arm all the same, now and then.
  void publish(const std::optional<ArmSample>& sample) {
    const double now_s = rig::host_now_s();
    if (!sample && now_s - published_s_ < kStatus_s) return;
    published_s_ = now_s;
    arm_status_t message{};
    guard_.fill(message);
    message.utime = sample ? std::llround(sample->time_s * 1e6) : rig::host_now_us();
    message.tool_wxyz[0] = 1;
    message.commands_refused += server_.refused();
    if (last_sample_) fill_pose(*last_sample_, message);
    bus_.publish(rig::channel(device_, rig::kArm), message);
    status_.set_refused(message.commands_refused);
    if (message.stop_text != said_) {
      said_ = message.stop_text;
      if (!said_.empty()) spdlog::warn("{}: stopped: {}", device_, said_);
    }
  }

  void fill_pose(const ArmSample& sample, arm_status_t& message) const {
    const Eigen::VectorXd& q = sample.q_rad;
    const Eigen::VectorXd commanded = guard_.hold_rad().size() == q.size() ? guard_.hold_rad() : q;
    message.joints = static_cast<int32_t>(q.size());
    message.q_rad.assign(q.begin(), q.end());
    message.q_commanded_rad.assign(commanded.begin(), commanded.end());
    message.qd_rad_s.assign(sample.qd_rad_s.begin(), sample.qd_rad_s.end());
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

  ArmConfiguration configuration_;
  const ArmModel model_;
  rig::Bus& bus_;
  Samples& samples_;
  rig::DeviceStatus status_;
  std::string device_;
  TrackerWatch tracker_;
  MotionGuard guard_;
  Planner planner_;
  std::optional<ArmSample> last_sample_;
  double published_s_ = 0;
  std::string said_;
  StopLatch latch_;
  ControlServer server_;  // last: its thread pulls the latch
};

}  // namespace

void run_daemon(const rig::Configuration& configuration, const std::atomic<bool>& stopping, const std::string& device) {
  const ArmConfiguration own = read_configuration(configuration.section(device));
  Samples samples;  // outlives the bus, whose thread fills it
  rig::Bus bus(configuration.bus());
  if (!own.tracker.empty())
    bus.subscribe<corner_sample_t>(rig::channel(own.tracker, rig::kCorners),
                                   [&](const auto& sample) { samples.push(sample); });
  Daemon daemon(own, control_socket(configuration, device), stop_file(configuration, device), bus, samples, device);
  bus.start();
  daemon.run(stopping);
}

}  // namespace selvedge::arm
