// ./selvedge arm stop|reset|status --config FILE: a person's word to the arm's daemon, without a console.
#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <selvedge_rig/arm_status_t.hpp>

#include "cli/command.h"
#include "files/bad_input.h"
#include "rig/arm/control_link.h"
#include "rig/bus.h"
#include "rig/channels.h"
#include "rig/clock.h"

namespace selvedge::cli {

namespace {

using selvedge_rig::arm_status_t;

constexpr double kState_s = 2;

// The arm's newest state. Throws std::runtime_error where its daemon says nothing.
arm_status_t state_of(const rig::Configuration& configuration) {
  std::mutex mutex;
  std::optional<arm_status_t> newest;
  rig::Bus bus(configuration.bus());
  bus.subscribe<arm_status_t>(rig::channel("arm", rig::kArm), [&](const arm_status_t& message) {
    const std::lock_guard lock(mutex);
    newest = message;
  });
  bus.start();
  for (const double until_s = rig::host_now_s() + kState_s; rig::host_now_s() < until_s;) {
    {
      const std::lock_guard lock(mutex);
      if (newest) return *newest;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  throw std::runtime_error(
      fmt::format("arm: its daemon says nothing within {} s; a stop reaches it all the same", kState_s));
}

std::string sentence(const arm_status_t& state) {
  if (state.latched) return fmt::format("stopped, until a person resets it: {}", state.stop_text);
  if (state.mode == arm_status_t::MODE_OFF) return "no connection to the controller";
  if (state.mode == arm_status_t::MODE_STOPPED) return "stopped, may be armed again: " + state.stop_text;
  if (state.mode == arm_status_t::MODE_MOVING) return "moves";
  return state.armed ? "armed, holds still" : "idle";
}

rig::Configuration load(const std::filesystem::path& file) {
  const rig::Configuration configuration = rig::Configuration::load(file);
  if (!configuration.has("arm")) refuse(file.string(), "has no section [arm], which this command is about");
  return configuration;
}

}  // namespace

void add_arm(CLI::App& app, int&) {
  auto* command = app.add_subcommand("arm", "stop the arm, reset a stop, or say how it stands");
  command->require_subcommand(1);
  auto file = std::make_shared<std::filesystem::path>();
  const auto add = [&](const char* name, const char* what) {
    auto* sub = command->add_subcommand(name, what);
    sub->add_option("--config", *file, "the rig's configuration file (TOML)")->required();
    return sub;
  };
  add("stop", "stop the arm, whoever holds it; it stays stopped until somebody resets it")->callback([file] {
    arm::stop_arm(load(*file), "stopped by a person at a terminal");
    fmt::print("stopped\n");
  });
  add("reset", "lift a stop, once everybody is clear of the arm; moves nothing")->callback([file] {
    const rig::Configuration configuration = load(*file);
    const arm_status_t state = state_of(configuration);
    if (!state.latched) refuse("arm", "no stop holds: {}", sentence(state));
    arm::ControlClient(arm::control_socket(configuration)).reset(state.stop_number, "a person at a terminal");
    fmt::print("reset: {}\n", state.stop_text);
  });
  add("status", "how the arm stands")->callback([file] { fmt::print("{}\n", sentence(state_of(load(*file)))); });
}

}  // namespace selvedge::cli
