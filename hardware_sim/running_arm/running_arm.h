// The arm's daemon between a bus, a simulated controller and a tracker, all in this process, for tests and proofs of
// what the arm really does: measured at the simulated joints.
#pragma once

#include <unistd.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <selvedge_rig/arm_status_t.hpp>
#include <selvedge_rig/corner_sample_t.hpp>

#include "hardware_sim/rtde_controller/rtde_controller.h"
#include "rig/arm/control_link.h"
#include "rig/arm/daemon.h"
#include "rig/bus.h"
#include "rig/clock.h"
#include "rig/network.h"
#include "rig/wire/socket.h"

namespace selvedge::hardware_sim {

// Tests run beside each other; the bus tells them apart by its port alone.
inline const int kArmBusPort = 20000 + ::getpid() % 20000;

class RunningArm {
 public:
  using Status = selvedge_rig::arm_status_t;

  // model: data/arms/ur5e.toml. Throws std::runtime_error where the host cannot carry the bus: what keeps people safe
  // is not to be passed over.
  explicit RunningArm(const std::filesystem::path& model) : model_file_(model), model_(arm::ArmModel::read(model)) {
    if (!rig::multicast_works(static_cast<uint16_t>(kArmBusPort))) throw std::runtime_error(rig::multicast_advice());
    folder_ = std::filesystem::temp_directory_path() / fmt::format("selvedge-arm-{}", ::getpid());
    std::filesystem::create_directories(folder_);
    socket_ = folder_ / "arm.socket";
    RtdeControllerOptions options;
    options.script_port = script_port_ = wire::local_port(wire::listen_tcp("127.0.0.1", 0));
    controller_ = std::make_unique<RtdeController>(options, model_);
    start_m_ = home_m_;
    configuration_ = rig::Configuration::parse(
        fmt::format("[bus]\nport = {}\n[arm]\nmodel = \"{}\"\nport = {}\nscript_port = {}\n"
                    "corner_distance_m = 0.3\nbase_position_m = [1.0, 2.0, 0.5]\nbase_rpy_deg = [0, 0, 90]\n"
                    "control_socket = \"{}\"\n",
                    kArmBusPort, model_file_.string(), controller_->port(), options.script_port, socket_.string()),
        "test.toml");
    bus_ = std::make_unique<rig::Bus>(configuration_.bus());
    rig::BusConfiguration other = configuration_.bus();
    other.key_file = folder_ / "forger.key";
    forger_ = std::make_unique<rig::Bus>(other);
    bus_->subscribe<Status>("ARM_ARM", [this](const auto& message) {
      const std::lock_guard lock(mutex_);
      status_ = message;
    });
    bus_->start();
    session_ = std::thread([this] { run_session(); });
    start_daemon();
  }
  ~RunningArm() {
    end_daemon();
    stopping_ = true;
    if (session_.joinable()) session_.join();
    bus_.reset();  // its thread fills what the test holds
    std::filesystem::remove_all(folder_);
  }

  void start_daemon() {
    daemon_stopping_ = false;
    daemon_ = std::thread([this] { arm::run_daemon(configuration_, daemon_stopping_); });
    if (!wait_for(
            [this](const auto& status) { return status.mode != Status::MODE_OFF && std::filesystem::exists(socket_); }))
      throw std::runtime_error("the arm's daemon does not come up");
  }
  void end_daemon() {
    daemon_stopping_ = true;
    if (daemon_.joinable()) daemon_.join();
    const std::lock_guard lock(mutex_);
    status_ = {};
  }

  // The tracker's samples and the session's heartbeat, 100 a second.
  void run_session() {
    const arm::ArmConfiguration own = arm::read_configuration(configuration_.section("arm"));
    while (!stopping_) {
      if (tracker_ != Tracker::silent) send_sample(own.world_from_base);
      heartbeat();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  void send_sample(const Eigen::Isometry3d& world_from_base) {
    if (tracker_ == Tracker::sees || tracker_ == Tracker::forged || sample_.count == 0) {
      ++sample_.frame_number;
      sample_.utime = rig::host_now_us();
      const Eigen::Vector3d right_m = world_from_base * controller_->tool_at(rig::host_now_s());
      const Eigen::Vector3d left_m = world_from_base * (home_m_ - Eigen::Vector3d(0.2, 0, 0));
      sample_.count = 2;
      sample_.name = {"left", "right"};
      sample_.x_m = {left_m.x(), right_m.x()};
      sample_.y_m = {left_m.y(), right_m.y()};
      sample_.z_m = {left_m.z(), right_m.z()};
      sample_.occluded = {0, 0};
    } else if (tracker_ == Tracker::stands_still) {  // new numbers and times, old places
      ++sample_.frame_number;
      sample_.utime = rig::host_now_us();
    } else if (tracker_ == Tracker::fresh_times) {  // a replay with a number that was there before
      sample_.utime = rig::host_now_us();
    }
    auto sent = sample_;
    if (tracker_ == Tracker::late) sent.utime -= 1'000'000;
    (tracker_ == Tracker::forged ? forger_ : bus_)->publish("TRACKER_CORNERS", sent);
  }
  void heartbeat() {
    const std::lock_guard lock(client_mutex_);
    if (!heart_beats_ || !client_) return;
    selvedge_rig::arm_command_t command{};
    command.lease_s = 0.1;
    command.action = follow_ != 0 ? selvedge_rig::arm_command_t::FOLLOW : selvedge_rig::arm_command_t::HOLD;
    command.trajectory_id = follow_;
    try {
      client_->command(command);
    } catch (const wire::Disconnected&) {
      // The daemon was ended.
    }
  }

  Status status() {
    const std::lock_guard lock(mutex_);
    return status_;
  }
  template <class Condition>
  bool wait_for(Condition condition, double limit_s = 20) {
    const double end_s = rig::host_now_s() + limit_s;
    while (rig::host_now_s() < end_s) {
      if (condition(status())) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

  arm::ControlClient& client() {
    const std::lock_guard lock(client_mutex_);
    if (!client_) client_ = std::make_unique<arm::ControlClient>(socket_);
    return *client_;
  }
  void let_go() {
    const std::lock_guard lock(client_mutex_);
    client_.reset();
  }
  void stop() { arm::stop_arm(configuration_, "test"); }
  void reset() {
    if (wait_for([](const auto& status) { return status.latched; }, 0.2)) client().reset(status().stop_number, "test");
    wait_for([](const auto& status) { return !status.latched; });
  }
  // Arms, with the heart beating; again where a busy machine let the lease run out.
  bool arm_it() {
    heart_beats_ = true;
    return wait_for([this](const auto& status) {
      if (status.armed) return true;
      try {
        client().arm("test");
      } catch (const arm::ControlRefused&) {
      } catch (const wire::Disconnected&) { let_go(); }
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      return false;
    });
  }
  static selvedge_rig::arm_trajectory_t to_message(int64_t id, const arm::ToolPath& path) {
    selvedge_rig::arm_trajectory_t message{};
    message.trajectory_id = id;
    message.points = static_cast<int32_t>(path.time_s.size());
    message.time_s = path.time_s;
    for (long i = 0; i < path.point_m.cols(); ++i) {
      message.x_m.push_back(path.point_m(0, i));
      message.y_m.push_back(path.point_m(1, i));
      message.z_m.push_back(path.point_m(2, i));
    }
    return message;
  }
  int8_t send_path(int64_t id, const arm::Sinusoid& sinusoid) {
    try {
      client().send(to_message(id, arm::make_sinusoid(start_m_, sinusoid)));
    } catch (const std::runtime_error&) { return Status::PLAN_NONE; }
    wait_for([&](const auto& status) {
      return !status.armed || (status.plan_id == id && status.plan_state >= Status::PLAN_READY);
    });
    return status().plan_state;
  }

  // Arms, sends a path from where the tool is and follows it until path time `until_s`. Several tries, since on a
  // busy machine the lease may run out at any moment, as it should.
  bool start_moving(const arm::Sinusoid& sinusoid, double until_s) {
    for (int attempt = 0; attempt < 10; ++attempt) {
      follow_ = 0;
      wait_for([&](const auto&) { return controller_->fastest_since(rig::host_now_s() - 0.2) < 0.01; });
      start_m_ = controller_->tool_at(rig::host_now_s());
      if (!arm_it() || send_path(++id_, sinusoid) != Status::PLAN_READY) continue;
      follow_ = id_;
      wait_for([&](const auto& status) { return status.trajectory_s > until_s || !status.armed; });
      if (status().mode == Status::MODE_MOVING) return true;
    }
    return false;
  }
  // First towards home, for a stop leaves the tool some way along: a hundred of them do not walk it off.
  bool wave_for_long() {
    arm::Sinusoid sinusoid{.amplitude_m = 0.02, .frequency_hz = 1, .duration_s = 60};
    if ((controller_->tool_at(rig::host_now_s()) - home_m_).dot(sinusoid.direction) > 0) sinusoid.direction *= -1;
    return start_moving(sinusoid, 1);
  }

  // From now, until the joints of the simulated controller rest; s.
  double time_to_rest(double limit_s = 5) {
    const double from_s = rig::host_now_s();
    double moved_s = from_s;
    Eigen::VectorXd before = controller_->joints_at(from_s);
    while (rig::host_now_s() < from_s + limit_s && rig::host_now_s() < moved_s + 0.5) {
      std::this_thread::sleep_for(std::chrono::milliseconds(4));
      const double now_s = rig::host_now_s();
      const Eigen::VectorXd joints = controller_->joints_at(now_s);
      if ((joints - before).cwiseAbs().maxCoeff() > 2e-5) moved_s = now_s;
      before = joints;
    }
    return moved_s - from_s;
  }

  enum class Tracker {
    sees,
    silent,
    repeats,
    stands_still,
    fresh_times,
    late,
    forged
  };  // forged: all as it should be, with another's key

  const std::filesystem::path model_file_;
  const arm::ArmModel model_;
  const Eigen::Vector3d home_m_ = model_.base_from_tool(model_.home_rad()).translation();
  std::filesystem::path folder_, socket_;
  int script_port_ = 0;
  int64_t id_ = 0;
  Eigen::Vector3d start_m_;
  std::unique_ptr<RtdeController> controller_;
  rig::Configuration configuration_;
  std::mutex mutex_, client_mutex_;
  Status status_{};
  selvedge_rig::corner_sample_t sample_{};  // the session thread's alone
  std::atomic<bool> stopping_ = false, daemon_stopping_ = false, heart_beats_ = false;
  std::atomic<Tracker> tracker_ = Tracker::sees;
  std::atomic<int64_t> follow_ = 0;
  std::unique_ptr<arm::ControlClient> client_;
  std::unique_ptr<rig::Bus> bus_, forger_;
  std::thread daemon_, session_;
};

}  // namespace selvedge::hardware_sim
