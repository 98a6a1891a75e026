#include "cli/verify/soak/soak.h"

#include <chrono>
#include <csignal>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include <fmt/format.h>
#include <selvedge_rig/arm_status_t.hpp>
#include <selvedge_rig/session_status_t.hpp>

#include "cli/verify/soak/arm_audit.h"
#include "cli/verify/soak/frame_audit.h"
#include "cli/verify/soak/people.h"
#include "cli/verify/soak/small_disk.h"
#include "files/shared_files.h"
#include "hardware_sim/simulated_rig.h"
#include "rig/bus.h"
#include "rig/camera/frame_ring.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include "rig/network.h"
#include "station/child_process.h"
#include "station/free_addresses.h"
#include "station/programs.h"
#include "station/rig_processes.h"
#include "station/simulated_rig.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;

constexpr size_t kDisk_bytes = size_t{256} << 20;
constexpr double kRestart_s = 1;
constexpr double kCalmStart_s = 8;   // before the first fault
constexpr double kLongestGap_s = 8;  // mean between faults; shorter in a short run, which shall see all kinds
constexpr double kRecovery_s = 120;
constexpr double kTick_s = 0.02, kFrameAudit_s = 2;

// A process that is started again a second after it ended.
class Supervised {
 public:
  Supervised(std::string name, std::vector<std::string> command, fs::path log)
      : name_(std::move(name)), command_(std::move(command)), log_(std::move(log)) {
    start();
  }

  const std::string& name() const { return name_; }
  void kill() {
    if (process_) ::kill(process_->pid(), SIGKILL);
    process_.reset();
    start_at_s_ = rig::host_now_s() + kRestart_s;
  }
  // Asks it to end, for good.
  void end() {
    process_.reset();
    start_at_s_ = std::numeric_limits<double>::infinity();
  }
  // Starts it where that is due. What it says of an end that nobody asked for goes to `crashes`.
  void look(std::vector<std::string>& crashes) {
    if (process_) {
      try {
        process_->require_running();
      } catch (const std::runtime_error& error) {
        crashes.emplace_back(error.what());
        process_.reset();
        start_at_s_ = rig::host_now_s() + kRestart_s;
      }
    } else if (rig::host_now_s() >= start_at_s_) {
      start();
    }
  }

 private:
  void start() { process_ = std::make_unique<station::ChildProcess>(name_, command_, log_); }
  const std::string name_;
  const std::vector<std::string> command_;
  const fs::path log_;
  double start_at_s_ = 0;
  std::unique_ptr<station::ChildProcess> process_;
};

class Soak {
 public:
  Soak(const SoakOptions& options, const fs::path& trials, bool small_disk)
      : options_(options), trials_(trials), configuration_(rig::Configuration::load(options.folder / "rig.toml")),
        devices_(hardware_sim::read_simulated_rig(options.folder / "world.toml")), frames_(trials),
        deck_(options.seed, std::min(kLongestGap_s, 3600 * options.hours / (1.3 * kFaultKinds))),
        bus_(configuration_.bus()),
        people_(
            configuration_, bus_, arm_, log_of("console"), [this] { kill_now("console"); }, options.seed) {
    result_.small_disk = small_disk;
    listen();
    const std::string lab = station::program(station::kLabProgram).string(), self = files::own_program().string(),
                      rig = (options.folder / "rig.toml").string();
    const auto start = [&](const std::string& name, const std::vector<std::string>& command) {
      processes_.emplace(name, std::make_unique<Supervised>(name, command, log_of(name)));
    };
    for (const std::string& kind : station::daemon_kinds(rig)) start(kind, {lab, "daemon", kind, "--config", rig});
    start("recorder", {self, "soak-recorder", "--config", rig, "--world", (options.folder / "world.toml").string(),
                       "--trials", trials.string()});
    start("console", {lab, "console", "--run", (options.folder / "console").string(), "--config", rig});
  }
  ~Soak() {
    processes_.clear();
    camera::FrameRingWriter::remove(camera::ring_name(configuration_.bus().port, "camera"));
  }

  SoakResult run(const std::atomic<bool>& stopping) {
    const double start_s = rig::host_now_s(), end_s = start_s + 3600 * options_.hours;
    double fault_s = start_s + kCalmStart_s;
    while (!stopping && rig::host_now_s() < end_s) {
      if (rig::host_now_s() >= fault_s) {
        inject(deck_.draw());
        fault_s = rig::host_now_s() + deck_.gap_s();
      }
      tick();
      options_.progress((rig::host_now_s() - start_s) / (end_s - start_s),
                        fmt::format("{} trials, {} frames lost", frames_.complete() + frames_.cut(), frames_.lost()));
    }
    recover(stopping);
    result_.hours = (rig::host_now_s() - start_s) / 3600;
    finish();
    return result_;
  }

 private:
  fs::path log_of(const std::string& name) const { return options_.folder / "logs" / (name + ".log"); }

  void listen() {
    bus_.subscribe<selvedge_rig::session_status_t>(rig::kSessionStatus,
                                                   [this](const auto& message) { frames_.hear(message); });
    bus_.subscribe<selvedge_rig::operator_prompt_t>(rig::kOperatorPrompt,
                                                    [this](const auto& message) { people_.hear(message); });
    bus_.subscribe<selvedge_rig::arm_status_t>(rig::channel("arm", rig::kArm),
                                               [this](const selvedge_rig::arm_status_t& message) {
      const double host_s = 1e-6 * static_cast<double>(message.utime);
      if (message.armed) arm_.armed(host_s);
      else arm_.not_armed(host_s);
      people_.hear(message);
    });
    bus_.start();
  }

  void tick() {
    const double now_s = rig::host_now_s();
    while (!reverts_.empty() && reverts_.begin()->first <= now_s) {
      reverts_.begin()->second();
      reverts_.erase(reverts_.begin());
    }
    {
      const std::lock_guard lock(processes_mutex_);
      for (auto& [name, process] : processes_) process->look(result_.crashes);
    }
    people_.look();
    look_at_arm(now_s - ArmAudit::kBehind_s);
    if (now_s - frames_looked_s_ > kFrameAudit_s) {
      frames_looked_s_ = now_s;
      frames_.look(false);
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(kTick_s));
  }

  // Speed from the simulated controller's own joints, between two looks.
  void look_at_arm(double host_s) {
    hardware_sim::RtdeController* arm = devices_.arm();
    if (!arm) return;
    const Eigen::VectorXd joints = arm->joints_at(host_s);
    if (joints_.size() == joints.size() && host_s > joints_s_)
      arm_.look(host_s, (joints - joints_).cwiseAbs().maxCoeff() / (host_s - joints_s_));
    joints_ = joints;
    joints_s_ = host_s;
  }

  void later(double seconds, std::function<void()> action) {
    reverts_.emplace(rig::host_now_s() + seconds, std::move(action));
  }

  void kill(const std::string& name) {
    if (name == "arm") arm_.not_armed(rig::host_now_s());
    kill_now(name);
  }
  // From any thread.
  void kill_now(const std::string& name) {
    const std::lock_guard lock(processes_mutex_);
    processes_.at(name)->kill();
  }
  void count(FaultKind kind) {
    const std::lock_guard lock(processes_mutex_);
    ++result_.faults[static_cast<size_t>(kind)];
  }

  void inject(const Fault& fault) {
    if (fault.kind == FaultKind::full_disk && !result_.small_disk) return;
    // What people do may not come about, where a daemon is away just then.
    if (of_people(fault.kind))
      return people_.act(fault.kind, fault.in_motion, [this, kind = fault.kind] { count(kind); });
    count(fault.kind);
    switch (fault.kind) {
      case FaultKind::packet_loss:
      case FaultKind::camera_stall:
      case FaultKind::camera_unplugged:
      case FaultKind::camera_clock_jump: return disturb_camera(fault);
      case FaultKind::tracker_stall: return devices_.tracker().stall(fault.duration_s);
      case FaultKind::tracker_cut: return devices_.tracker().cut_connections();
      case FaultKind::occlusion: return devices_.tracker().hide(fault.duration_s);
      case FaultKind::projector_hang: return devices_.projector().hang(fault.duration_s);
      case FaultKind::projector_cut: return devices_.projector().disconnect();
      case FaultKind::arm_cut: return devices_.arm()->cut_connections();
      case FaultKind::arm_protective_stop:
        devices_.arm()->protective_stop();
        return later(fault.duration_s, [this] { devices_.arm()->clear_protective_stop(); });
      case FaultKind::full_disk: fill_disk(trials_); return later(fault.duration_s, [this] { clear_disk(trials_); });
      case FaultKind::kill_camera: return kill("camera");
      case FaultKind::kill_tracker: return kill("tracker");
      case FaultKind::kill_projector: return kill("projector");
      case FaultKind::kill_arm: return kill("arm");
      case FaultKind::kill_recorder: return kill("recorder");
      default: return;
    }
  }

  void disturb_camera(const Fault& fault) {
    if (fault.kind == FaultKind::camera_clock_jump) return devices_.camera().step_clock(fault.amount);
    if (fault.kind == FaultKind::packet_loss) camera_faults_.stream_loss = fault.amount;
    if (fault.kind == FaultKind::camera_unplugged) camera_faults_.unplugged = true;
    if (fault.kind == FaultKind::camera_stall) {
      camera_faults_.stall_probability = 0.1;
      camera_faults_.stall_s = fault.amount;
    }
    devices_.camera().set_faults(camera_faults_);
    later(fault.duration_s, [this, kind = fault.kind] {
      if (kind == FaultKind::packet_loss) camera_faults_.stream_loss = 0;
      if (kind == FaultKind::camera_unplugged) camera_faults_.unplugged = false;
      if (kind == FaultKind::camera_stall) camera_faults_.stall_probability = 0;
      devices_.camera().set_faults(camera_faults_);
    });
  }

  // No fault any more: a whole trial must follow. The one that runs may still be a victim.
  void recover(const std::atomic<bool>& stopping) {
    for (auto& [due_s, revert] : reverts_) revert();
    reverts_.clear();
    people_.go_home();
    frames_.look(false);
    const int before = frames_.complete();
    const double until_s = rig::host_now_s() + kRecovery_s;
    while (!stopping && !result_.recovered && rig::host_now_s() < until_s) {
      tick();
      options_.progress(1, "waiting for a whole trial after the last fault");
      result_.recovered = frames_.complete() > before;
    }
  }

  void finish() {
    people_.go_home();
    for (auto& [name, process] : processes_) process->look(result_.crashes);
    processes_.at("recorder")->end();
    std::this_thread::sleep_for(std::chrono::milliseconds(500));  // for its last words
    frames_.look(true);
    result_.trials_complete = frames_.complete();
    result_.trials_cut = frames_.cut();
    result_.frames_written = frames_.written();
    result_.frames_lost = frames_.lost();
    result_.losses = frames_.losses();
    result_.stops = arm_.stops();
    result_.operator_stops = arm_.operator_stops();
    result_.stops_in_motion = arm_.stops_in_motion();
    result_.resets = people_.resets();
    result_.motions_after_stop = arm_.motions_after_stop();
    result_.longest_time_to_rest_s = arm_.longest_time_to_rest_s();
    result_.longest_after_operator_s = arm_.longest_after_operator_s();
    result_.violations = people_.violations();
  }

  const SoakOptions options_;
  const fs::path trials_;
  const rig::Configuration configuration_;
  hardware_sim::SimulatedRig devices_;
  FrameAudit frames_;
  ArmAudit arm_;
  FaultDeck deck_;
  SoakResult result_;
  sim::GigeCameraFaults camera_faults_;
  std::multimap<double, std::function<void()>> reverts_;
  std::map<std::string, std::unique_ptr<Supervised>> processes_;
  Eigen::VectorXd joints_;
  double joints_s_ = 0, frames_looked_s_ = 0;
  std::mutex processes_mutex_;  // guards processes_ and the counts of faults
  rig::Bus bus_;
  People people_;  // last: its threads use the rest
};

}  // namespace

bool SoakResult::each_often_enough() const {
  if (hours < 1) return true;
  for (int kind = 0; kind < kFaultKinds; ++kind)
    if (faults[static_cast<size_t>(kind)] < kLeastEach &&
        (small_disk || static_cast<FaultKind>(kind) != FaultKind::full_disk))
      return false;
  return true;
}

SoakResult soak(const SoakOptions& options, const std::atomic<bool>& stopping) {
  rig::ensure_local_multicast(static_cast<uint16_t>(station::free_bus_port()));
  const fs::path trials = options.folder / "trials";
  const bool small_disk = mount_small_disk(trials, kDisk_bytes);
  fs::create_directories(options.folder / "logs");
  station::write_simulated_rig({options.rig, options.world, options.arms}, options.folder);
  return Soak(options, trials, small_disk).run(stopping);
}

nlohmann::json to_json(const SoakResult& result, unsigned seed) {
  nlohmann::json faults = nlohmann::json::object();
  for (int kind = 0; kind < kFaultKinds; ++kind)
    faults[to_text(static_cast<FaultKind>(kind))] = result.faults[static_cast<size_t>(kind)];
  return {{"format", "soak/1"},
          {"hours", result.hours},
          {"seed", seed},
          {"holds", result.holds()},
          {"trials", {{"complete", result.trials_complete}, {"cut", result.trials_cut}}},
          {"frames", {{"written", result.frames_written}, {"lost", result.frames_lost}, {"losses", result.losses}}},
          {"faults", faults},
          {"full_disk_possible", result.small_disk},
          {"arm",
           {{"stops", result.stops},
            {"operator_stops", result.operator_stops},
            {"stops_in_motion", result.stops_in_motion},
            {"resets", result.resets},
            {"motions_after_stop", result.motions_after_stop},
            {"longest_time_to_rest_s", result.longest_time_to_rest_s},
            {"longest_after_operator_stop_s", result.longest_after_operator_s},
            {"violations", result.violations}}},
          {"daemons_ended_by_themselves", result.crashes},
          {"recovered", result.recovered}};
}

std::string to_text(const SoakResult& result) {
  std::string text = fmt::format("{:.3f} hours\ntrials                        {} complete, {} cut\n", result.hours,
                                 result.trials_complete, result.trials_cut);
  text += fmt::format("frames written                {}\nframes lost                   {}\n", result.frames_written,
                      result.frames_lost);
  text += fmt::format("stops of the arm              {} ({} in motion), longest time to rest {:.2f} s\n", result.stops,
                      result.stops_in_motion, result.longest_time_to_rest_s);
  text += fmt::format("operators' stops              {}, longest time to rest {:.2f} s; {} words to reset\n",
                      result.operator_stops, result.longest_after_operator_s, result.resets);
  text += fmt::format("motions after a stop          {}, at the simulated joints\n", result.motions_after_stop);
  text += fmt::format("daemons ended by themselves   {}\n", result.crashes.size());
  text += fmt::format("whole trial after the faults  {}\nfaults injected\n", result.recovered ? "yes" : "no");
  for (int kind = 0; kind < kFaultKinds; ++kind)
    text +=
        fmt::format("  {:<27} {}\n", to_text(static_cast<FaultKind>(kind)), result.faults[static_cast<size_t>(kind)]);
  if (!result.small_disk) text += "no disk ran full: this user may not mount one\n";
  for (const std::string& sentence : result.losses) text += "lost: " + sentence + '\n';
  for (const std::string& sentence : result.violations) text += "violation: " + sentence + '\n';
  if (!result.each_often_enough()) text += fmt::format("a kind of fault came fewer than {} times\n", kLeastEach);
  for (const std::string& sentence : result.crashes) text += "ended: " + sentence + '\n';
  return text;
}

}  // namespace selvedge::cli
