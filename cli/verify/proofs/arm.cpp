// `./selvedge prove arm`: a stop is a stop, measured at the joints of the simulated controller.
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <thread>

#include <spdlog/spdlog.h>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/stopped_trials.h"
#include "files/shared_files.h"
#include "hardware_sim/running_arm/running_arm.h"
#include "rig/arm/real_time.h"
#include "rig/network.h"
#include "station/free_addresses.h"

namespace selvedge::cli {

namespace {

using hardware_sim::RunningArm;
using selvedge_rig::arm_control_t;
using selvedge_rig::arm_status_t;

constexpr double kRest_s = 0.3;  // asked of a stop
constexpr int kFlood = 10000;

// Sends a stop, and 10,000 messages behind it on the same connection; the time to rest from the stop on.
double stop_before_flood(RunningArm& arm) {
  const wire::Socket mad = wire::connect_unix(arm.socket_);
  arm_control_t message{};
  message.action = arm_control_t::STOP;
  message.reason = "before a flood";
  const double sent_s = rig::host_now_s();
  mad.send(arm::encode_frame(arm::FrameKind::control, message));
  std::thread flood([&] {
    message.action = arm_control_t::ARM;
    try {
      for (int i = 0; i < kFlood; ++i) {
        message.sequence = i;
        message.utime = rig::host_now_us();
        mad.send(arm::encode_frame(arm::FrameKind::control, message));
      }
    } catch (const wire::Disconnected&) {
      // It reads none of its answers, so the daemon hangs up on it.
    }
  });
  const double rest_s = rig::host_now_s() - sent_s + arm.time_to_rest();
  flood.join();
  return rest_s;
}

void prove_flood(RunningArm& arm, int rounds, const FigureOptions& options, std::vector<Figure>& figures) {
  std::vector<double> rests_s;
  for (int round = 0; round < rounds; ++round) {
    options.progress(0.3 * round / rounds, fmt::format("a stop before a flood, {} of {}", round + 1, rounds));
    arm.reset();
    if (!arm.wave_for_long()) throw std::runtime_error("the arm does not move");
    rests_s.push_back(stop_before_flood(arm));
  }
  const auto in_time = std::count_if(rests_s.begin(), rests_s.end(), [](double s) { return s <= kRest_s; });
  figures.push_back({"stop before 10,000 messages: at rest within 0.3 s", static_cast<double>(in_time),
                     static_cast<double>(rounds), fmt::format("of {}", rounds), Relation::at_least, "each"});
  figures.push_back({"its time to rest, median", 1e3 * median(rests_s), 1e3 * kRest_s, "ms", Relation::at_most,
                     "the ramp takes 150 ms"});
  figures.push_back({"its time to rest, longest", 1e3 * *std::max_element(rests_s.begin(), rests_s.end()),
                     1e3 * kRest_s, "ms", Relation::at_most, "asked"});
}

// When the daemon first said, after `from_s`, that the arm is not armed: by the time of the measurement that it was
// said with, not by when that was heard here.
double not_armed_since(RunningArm& arm, double from_s) {
  std::mutex mutex;
  double since_s = std::numeric_limits<double>::infinity();
  rig::Bus bus(arm.configuration_.bus());
  bus.subscribe<arm_status_t>("ARM_ARM", [&](const auto& message) {
    const std::lock_guard lock(mutex);
    const double said_s = 1e-6 * static_cast<double>(message.utime);
    if (!message.armed && said_s >= from_s) since_s = std::min(since_s, said_s);
  });
  bus.start();
  arm.wait_for([&](const auto&) {
    const std::lock_guard lock(mutex);
    return std::isfinite(since_s);
  });
  const std::lock_guard lock(mutex);
  return since_s;
}

void prove_tracker(RunningArm& arm, std::vector<Figure>& figures) {
  using Tracker = RunningArm::Tracker;
  double longest_s = 0;
  for (const Tracker fault : {Tracker::silent, Tracker::repeats, Tracker::fresh_times, Tracker::late,
                              Tracker::stands_still, Tracker::forged}) {
    arm.tracker_ = Tracker::sees;
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    arm.reset();
    if (!arm.wave_for_long()) throw std::runtime_error("the arm does not move");
    const double lost_s = rig::host_now_s();
    arm.tracker_ = fault;
    longest_s = std::max(longest_s, not_armed_since(arm, lost_s) - lost_s);
  }
  arm.tracker_ = Tracker::sees;
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  figures.push_back({"tracker silent, repeated, replayed, late, standing still, forged: longest to the stop", longest_s,
                     0.5 + 0.05, "s", Relation::at_most, "tracker_timeout_s 0.5, and two periods and a look"});
}

// When the machine paused: a clock on a thread with the control loop's own priority that asks for a look each
// millisecond, and notes each time that it was let wait.
class PauseWatch {
 public:
  PauseWatch() : thread_([this](const std::stop_token& ending) { run(ending); }) {}
  // How long it waited between two host times, s.
  double paused_s(double from_s, double until_s) const {
    const std::lock_guard lock(mutex_);
    double sum_s = 0;
    for (const auto& [begin_s, end_s] : pauses_)
      sum_s += std::max(0.0, std::min(end_s, until_s) - std::max(begin_s, from_s));
    return sum_s;
  }

 private:
  void run(const std::stop_token& ending) {
    constexpr double kLook_s = 0.001;
    arm::ask_for_real_time();
    double before_s = rig::host_now_s();
    while (!ending.stop_requested()) {
      std::this_thread::sleep_for(std::chrono::duration<double>(kLook_s));
      const double now_s = rig::host_now_s();
      if (now_s - before_s > 2 * kLook_s) {
        const std::lock_guard lock(mutex_);
        pauses_.emplace_back(before_s + kLook_s, now_s);
      }
      before_s = now_s;
    }
  }
  mutable std::mutex mutex_;
  std::vector<std::pair<double, double>> pauses_;  // guarded
  std::jthread thread_;
};

struct Gaps {
  double longest = 0, without_pauses = 0;  // periods of 8 ms
};

// The longest time between two states of the arm in 2 s, while the two longest paths are checked; and the longest less
// what the machine itself paused in it.
Gaps longest_gaps(RunningArm& arm) {
  arm.start_m_ = arm.controller_->tool_at(rig::host_now_s());
  std::mutex mutex;
  std::vector<double> states_s;
  rig::Bus bus(arm.configuration_.bus());
  bus.subscribe<arm_status_t>("ARM_ARM", [&](const auto& message) {
    const std::lock_guard lock(mutex);
    states_s.push_back(1e-6 * static_cast<double>(message.utime));
  });
  const PauseWatch machine;
  bus.start();
  for (const int64_t id : {7001, 7002}) {
    try {
      arm.client().send(
          RunningArm::to_message(id, arm::make_sinusoid(arm.start_m_, {.amplitude_m = 0.02, .duration_s = 600})));
    } catch (const std::runtime_error&) {
      // The first is still being checked: the second is refused at once.
    }
    std::this_thread::sleep_for(std::chrono::seconds(1));
  }
  const std::lock_guard lock(mutex);
  Gaps gaps;
  for (size_t i = 1; i < states_s.size(); ++i) {
    const double gap_s = states_s[i] - states_s[i - 1];
    gaps.longest = std::max(gaps.longest, gap_s / 0.008);
    gaps.without_pauses =
        std::max(gaps.without_pauses, (gap_s - machine.paused_s(states_s[i - 1], states_s[i])) / 0.008);
  }
  return gaps;
}

void prove_planning(RunningArm& arm, int rounds, std::vector<Figure>& figures) {
  arm.reset();
  arm.follow_ = 0;
  arm.arm_it();
  std::vector<double> longest;
  double without_pauses = 0;
  for (int i = 0; i < rounds; ++i) {
    const Gaps gaps = longest_gaps(arm);
    longest.push_back(gaps.longest);
    without_pauses = std::max(without_pauses, gaps.without_pauses);
  }
  figures.push_back(
      {fmt::format("two longest paths checked, {} times: longest gap of the control loop, median", rounds),
       median(longest), 2.05, "periods", Relation::at_most, "asked: two"});
  figures.push_back({"the longest of them all, less what the machine paused in it", without_pauses, 2.05, "periods",
                     Relation::at_most, "asked: two; a clock of the same priority tells the pauses"});
  figures.push_back({"the longest of them all, pauses of the machine included", std::ranges::max(longest), 2.05,
                     "periods", Relation::shown, "what this machine allows"});
}

void prove_phases(const std::vector<StoppedTrial>& trials, double watch_s, std::vector<Figure>& figures) {
  for (const StoppedTrial& trial : trials) {
    const std::string name = "stopped when " + trial.phase;
    figures.push_back(
        {name + ": time to rest", 1e3 * trial.time_to_rest_s, 1e3 * kRest_s, "ms", Relation::at_most, "asked"});
    figures.push_back({fmt::format("{}: set-points in the {:.0f} s after it", name, watch_s),
                       static_cast<double>(trial.set_points_after_rest), 0, "", Relation::at_most, "none"});
    figures.push_back({name + ": the session asks, and goes on after the word",
                       static_cast<double>(trial.asked + trial.completed), 2, "of 2", Relation::at_least, "both"});
  }
}

}  // namespace

std::vector<Figure> prove_arm(const FigureOptions& options) {
  rig::ensure_local_multicast(static_cast<uint16_t>(station::free_bus_port()));
  spdlog::set_level(spdlog::level::err);
  std::vector<Figure> figures;
  const double watch_s = options.quick ? 4 : 60;
  const auto trials = stop_in_each_phase(watch_s, options.quick ? 2 : 1, [&](double done, const std::string& what) {
    options.progress(0.6 * done, what);
  });
  {
    RunningArm arm(files::shared_folder() / "data" / "arms" / "ur5e.toml");
    prove_flood(arm, options.quick ? 5 : 100,
                {options.quick, options.seed,
                 [&](double done, const std::string& what) { options.progress(0.6 + done, what); }},
                figures);
    prove_tracker(arm, figures);
    prove_planning(arm, options.quick ? 3 : 10, figures);
  }
  prove_phases(trials, watch_s, figures);
  return figures;
}

}  // namespace selvedge::cli
