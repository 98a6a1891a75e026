// ./selvedge rig up|status|down --config FILE: the rig's daemons as processes that live on by themselves.
#include <filesystem>
#include <memory>
#include <string>

#include <fmt/format.h>

#include "cli/command.h"
#include "station/rig_processes.h"

namespace selvedge::cli {

namespace {

using selvedge_rig::device_status_t;

const char* state_text(const station::DaemonState& state) {
  if (!state.status) return state.pid ? "silent" : "not started";
  switch (state.status->state) {
    case device_status_t::STARTING: return "starting";
    case device_status_t::RUNNING: return "running";
    case device_status_t::DEGRADED: return "degraded";
    case device_status_t::LOST: return "lost";
    default: return "stopped";
  }
}

bool runs(const station::DaemonState& state) {
  return state.status &&
         (state.status->state == device_status_t::RUNNING || state.status->state == device_status_t::DEGRADED);
}

// Returns whether all of them run.
bool print(const std::vector<station::DaemonState>& states) {
  fmt::print("{:<10} {:>8} {:<12} {:>9} {:>11} {:>8} {:>8}  {}\n", "device", "process", "state", "rate", "delivered",
             "drops", "refused", "");
  bool all = true;
  for (const station::DaemonState& state : states) {
    const device_status_t status = state.status.value_or(device_status_t{});
    fmt::print("{:<10} {:>8} {:<12} {:>6.1f}/s {:>11} {:>8} {:>8}  {}\n", state.kind, state.pid.value_or(0),
               state_text(state), status.rate_hz, status.delivered, status.drops, status.refused, status.message);
    all = all && runs(state);
  }
  for (const station::DaemonState& state : states)
    if (!runs(state) && exists(state.log)) fmt::print("{}: see {}\n", state.kind, state.log.string());
  return all;
}

}  // namespace

void add_rig(CLI::App& app, int& exit_status) {
  auto* command = app.add_subcommand("rig", "start, look at and stop the device daemons of a rig");
  command->require_subcommand(1);
  auto file = std::make_shared<std::filesystem::path>();
  const auto add = [&](const char* name, const char* what) {
    auto* sub = command->add_subcommand(name, what);
    sub->add_option("--config", *file, "the rig's configuration file (TOML)")->required();
    return sub;
  };
  add("up", "start the daemons that do not run yet")->callback([file] {
    for (const auto& state : station::rig_up(*file))
      fmt::print("{}: process {}, log {}\n", state.kind, state.pid.value_or(0), state.log.string());
  });
  add("status", "what each daemon says; exit 1 where one does not run")->callback([file, &exit_status] {
    if (!print(station::rig_status(*file, 2.0))) exit_status = 1;
  });
  add("down", "end the daemons")->callback([file] {
    for (const std::string& kind : station::rig_down(*file)) fmt::print("{} ended\n", kind);
  });
}

}  // namespace selvedge::cli
