// ./selvedge daemon KIND --config FILE: runs one device daemon until Ctrl-C or SIGTERM.
#include <atomic>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include <spdlog/spdlog.h>

#include "cli/command.h"
#include "cli/stop_signals.h"
#include "rig/arm/daemon.h"
#include "rig/camera/daemon.h"
#include "rig/projector/daemon.h"
#include "rig/tracker/daemon.h"

namespace selvedge::cli {

namespace {

// Runs until `stopping`; device: the section of the configuration.
using RunDaemon = void (*)(const rig::Configuration&, const std::atomic<bool>& stopping, const std::string& device);

const std::map<std::string, RunDaemon>& daemons() {
  static const std::map<std::string, RunDaemon> table = {
      {"arm", arm::run_daemon},
      {"camera", camera::run_daemon},
      {"projector", projector::run_daemon},
      {"tracker", tracker::run_daemon},
  };
  return table;
}

struct DaemonArguments {
  std::string kind;
  std::filesystem::path configuration;
};

}  // namespace

void add_daemon(CLI::App& app, int&) {
  auto* command = app.add_subcommand("daemon", "run one device daemon of the rig until Ctrl-C or SIGTERM");
  auto a = std::make_shared<DaemonArguments>();
  command->add_option("kind", a->kind, "which device")->required()->check(CLI::IsMember(daemons()));
  command->add_option("--config", a->configuration, "the rig's configuration file (TOML)")->required();
  command->callback([a] {
    const auto configuration = rig::Configuration::load(a->configuration);
    const std::atomic<bool>& stopping = stop_on_signals();
    spdlog::info("{}: daemon starts, configuration {}", a->kind, a->configuration.string());
    daemons().at(a->kind)(configuration, stopping, a->kind);
    spdlog::info("{}: daemon ends", a->kind);
  });
}

}  // namespace selvedge::cli
