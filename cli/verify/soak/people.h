// The people of `./selvedge soak`: an operator who stops the arm and, a while later, gives the word that lifts the
// stop; and those who ought not to be there: a second sender, a flood, a stranger at the script port, a console that is
// killed.
//
// Each act runs on a thread of its own, so that the soak goes on looking at the arm. What must not happen and did is a
// sentence in `violations`.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <selvedge_rig/arm_status_t.hpp>
#include <selvedge_rig/operator_prompt_t.hpp>

#include "cli/verify/soak/arm_audit.h"
#include "cli/verify/soak/faults.h"
#include "rig/bus.h"
#include "rig/configuration.h"

namespace selvedge::cli {

class People {
 public:
  // console_log: what the console that runs now has printed; kill_console: kill -9.
  People(const rig::Configuration& configuration, rig::Bus& bus, ArmAudit& audit, std::filesystem::path console_log,
         std::function<void()> kill_console, unsigned seed);
  ~People();

  // From the bus's thread.
  void hear(const selvedge_rig::arm_status_t& status);
  void hear(const selvedge_rig::operator_prompt_t& prompt);

  // Faults of people. in_motion: waits until the arm moves, but not for ever. done: called once it was really done.
  void act(FaultKind kind, bool in_motion, std::function<void()> done);
  // Lifts stops that have held for long enough.
  void look();
  // Waits for the acts that are under way; no new ones begin.
  void go_home();

  std::vector<std::string> violations() const;
  int resets() const { return resets_; }

 private:
  void stop_once();
  void stop_in_flood();
  void second_sender();
  void steal_script();
  bool use_console();
  void violate(const std::string& what);
  std::optional<selvedge_rig::arm_status_t> wait_until(
      const std::function<bool(const selvedge_rig::arm_status_t&)>& state, double limit_s);
  std::optional<selvedge_rig::arm_status_t> heard_after(double host_s);

  const rig::Configuration configuration_;
  rig::Bus& bus_;
  ArmAudit& audit_;
  const std::filesystem::path console_log_;
  const std::function<void()> kill_console_;
  mutable std::mutex mutex_;  // guards down to violations_
  std::mt19937 random_;
  selvedge_rig::arm_status_t status_{};
  selvedge_rig::operator_prompt_t prompt_{};
  double latched_since_s_ = -1, not_armed_s_ = 0 /* as measured */, hold_s_ = 3, tried_s_ = 0;
  std::vector<std::string> violations_;
  std::atomic<int> resets_{0};
  std::atomic<bool> ending_{false};
  std::list<std::jthread> acts_;
};

}  // namespace selvedge::cli
