#include "cli/verify/proofs/stopped_trials.h"

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include <fmt/format.h>
#include <selvedge_rig/arm_status_t.hpp>
#include <selvedge_rig/operator_answer_t.hpp>
#include <selvedge_rig/operator_prompt_t.hpp>
#include <selvedge_rig/session_status_t.hpp>
#include <unistd.h>

#include "capture/session/run_trial.h"
#include "files/shared_files.h"
#include "hardware_sim/simulated_rig.h"
#include "rig/arm/control_link.h"
#include "rig/camera/frame_ring.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include "station/child_process.h"
#include "station/programs.h"
#include "station/rig_processes.h"
#include "station/simulated_rig.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;
using selvedge_rig::arm_status_t;

constexpr double kPhase_s = 120;       // for a phase to come
constexpr double kTrialLimit_s = 180;  // for the trial to end after the reset
constexpr double kMoves_rad = 2e-4;    // of a joint between two looks of 10 ms: a braking arm, not its encoder's noise

// What the bus says of the session and the arm.
struct BusListener {
  explicit BusListener(const rig::BusConfiguration& configuration) : bus(configuration) {
    bus.subscribe<arm_status_t>(rig::channel("arm", rig::kArm), [this](const auto& message) {
      const std::lock_guard lock(mutex);
      if (message.mode == arm_status_t::MODE_MOVING) has_moved = true;
      if (!message.armed) has_moved = false;
      arm = message;
    });
    bus.subscribe<selvedge_rig::operator_prompt_t>(rig::kOperatorPrompt, [this](const auto& message) {
      const std::lock_guard lock(mutex);
      prompt = message;
    });
    bus.subscribe<selvedge_rig::session_status_t>(rig::kSessionStatus, [this](const auto& message) {
      const std::lock_guard lock(mutex);
      if (message.step == "recording") recorded_us = message.utime;
    });
    bus.start();
  }
  // Whether the condition held within limit_s.
  bool wait_for(const std::function<bool(const BusListener&)>& condition, double limit_s) {
    for (const double until_s = rig::host_now_s() + limit_s; rig::host_now_s() < until_s;) {
      {
        const std::lock_guard lock(mutex);
        if (condition(*this)) return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return false;
  }
  bool asks(const char* step) const { return prompt.step == step && prompt.utime > rig::host_now_us() - 2'000'000; }
  bool records() const { return recorded_us > rig::host_now_us() - 300'000; }

  std::mutex mutex;
  arm_status_t arm{};
  bool has_moved = false;
  selvedge_rig::operator_prompt_t prompt{};
  int64_t recorded_us = 0;
  rig::Bus bus;
};

struct Phase {
  const char* name;
  std::function<bool(const BusListener&)> now;
};

const std::vector<Phase>& phases() {
  static const std::vector<Phase> list = {
      {"asked to hang the fabric", [](const BusListener& h) { return h.asks("robot_path"); }},
      {"waiting for rest", [](const BusListener& h) { return h.asks("stand_back"); }},
      {"armed", [](const BusListener& h) { return h.arm.armed && !h.has_moved && !h.records(); }},
      {"lead-in", [](const BusListener& h) { return h.arm.armed && !h.has_moved && h.records(); }},
      {"moving", [](const BusListener& h) { return h.arm.trajectory_s > 1.2; }},
      {"tail",
       [](const BusListener& h) { return h.arm.armed && h.has_moved && h.arm.mode == arm_status_t::MODE_IDLE; }}};
  return list;
}

class Rig {
 public:
  Rig()
      : folder_(fs::temp_directory_path() / fmt::format("selvedge-stopped-{}", ::getpid())),
        configuration_((prepare(), rig::Configuration::load(folder_ / "rig.toml"))),
        simulated_(hardware_sim::read_simulated_rig(folder_ / "world.toml")), devices_(simulated_) {
    for (const std::string& kind : station::daemon_kinds(folder_ / "rig.toml"))
      daemons_.push_back(std::make_unique<station::ChildProcess>(
          kind,
          std::vector<std::string>{station::program(station::kLabProgram).string(), "daemon", kind, "--config",
                                   (folder_ / "rig.toml").string()},
          folder_ / (kind + ".log")));
    listener_ = std::make_unique<BusListener>(configuration_.bus());
  }
  ~Rig() {
    listener_.reset();
    daemons_.clear();
    camera::FrameRingWriter::remove(camera::ring_name(configuration_.bus().port, "camera"));
    fs::remove_all(folder_);
  }

  StoppedTrial stop_in(const Phase& phase, int number, double watch_s) {
    StoppedTrial out;
    out.phase = phase.name;
    std::atomic<bool> over = false;
    std::thread session([&] {
      try {
        session::RigClient client(configuration_);
        client.wait_until_running(60, [](const std::string&) {});
        const session::SessionPlan plan = session::read_session_plan(configuration_);
        session::TrialPlan trial = plan.trials.front();
        trial.name = fmt::format("stopped-{}", number);
        trial.lead_in_s = 1.5;
        trial.tail_s = 2;
        trial.duration_s = 7.5;
        trial.attempts = 5;  // a machine that pauses for longer than the lease stops the arm too
        session::run_trial(client, configuration_, plan, trial, {simulated_.world.camera, simulated_.world.projector},
                           folder_, [](double, const std::string&) {});
        out.completed = true;
      } catch (const std::exception& error) { out.phase += fmt::format(" ({})", error.what()); }
      over = true;
    });
    if (listener_->wait_for(phase.now, kPhase_s)) {
      arm::stop_arm(configuration_, "an operator");
      watch(out, watch_s);
      answer(over);
    } else {
      out.phase += " (never came)";
    }
    for (const double until_s = rig::host_now_s() + kTrialLimit_s; !over && rig::host_now_s() < until_s;) answer(over);
    session.join();
    return out;
  }

 private:
  void prepare() {
    const fs::path source = files::shared_folder() / "data";
    fs::create_directories(folder_);
    station::write_simulated_rig({source / "soak" / "rig.toml", source / "soak" / "world.toml", source / "arms"},
                                 folder_);
  }

  // From the stop on. A tenth of a second beyond the last motion the arm rests for good, or the proof fails.
  void watch(StoppedTrial& out, double watch_s) {
    const double stopped_s = rig::host_now_s();
    hardware_sim::RtdeController& controller = *devices_.arm();
    double moved_s = stopped_s;
    Eigen::VectorXd before = controller.joints_at(stopped_s);
    while (rig::host_now_s() < stopped_s + 1.5) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      const double now_s = rig::host_now_s();
      const Eigen::VectorXd joints = controller.joints_at(now_s);
      if ((joints - before).cwiseAbs().maxCoeff() > kMoves_rad) moved_s = now_s;
      before = joints;
    }
    out.time_to_rest_s = moved_s - stopped_s;
    const auto count = controller.counts().set_points;
    while (rig::host_now_s() < stopped_s + watch_s) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      out.moved_rad = std::max(out.moved_rad, (controller.joints_at(rig::host_now_s()) - before).cwiseAbs().maxCoeff());
      const std::lock_guard lock(listener_->mutex);
      out.asked = out.asked || listener_->asks("reset_stop");
    }
    out.set_points_after_rest = controller.counts().set_points - count;
  }

  // A person's word, where one is asked for.
  void answer(const std::atomic<bool>& over) {
    if (over ||
        !listener_->wait_for([](const BusListener& h) { return h.prompt.step == "reset_stop" && h.arm.latched; }, 0.5))
      return;
    selvedge_rig::operator_answer_t given{};
    {
      const std::lock_guard lock(listener_->mutex);
      given.prompt_id = listener_->prompt.prompt_id;
    }
    given.utime = rig::host_now_us();
    given.answer = "reset";
    listener_->bus.publish(rig::kOperatorAnswer, given);
    listener_->wait_for([](const BusListener& h) { return !h.arm.latched; }, 2);
  }

  const fs::path folder_;
  const rig::Configuration configuration_;
  const hardware_sim::SimulatedRigConfiguration simulated_;
  hardware_sim::SimulatedRig devices_;
  std::vector<std::unique_ptr<station::ChildProcess>> daemons_;
  std::unique_ptr<BusListener> listener_;
};

}  // namespace

std::vector<StoppedTrial> stop_in_each_phase(double watch_s, size_t every, const report::ProgressCallback& progress) {
  Rig rig;
  std::vector<StoppedTrial> out;
  for (size_t i = 0; i < phases().size(); i += every) {
    progress(static_cast<double>(i) / static_cast<double>(phases().size()),
             fmt::format("a stop: {}", phases()[i].name));
    out.push_back(rig.stop_in(phases()[i], static_cast<int>(i), watch_s));
  }
  return out;
}

}  // namespace selvedge::cli
