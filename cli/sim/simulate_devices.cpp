// ./selvedge simulate-devices --config FILE: every simulated device of a rig around one simulated fabric, until
// Ctrl-C or SIGTERM.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <thread>

#include "cli/command.h"
#include "cli/stop_signals.h"
#include "files/whole_file.h"
#include "hardware_sim/simulated_rig.h"

namespace selvedge::cli {

namespace {

struct SimulateDevicesArguments {
  std::filesystem::path configuration, truth;
};

}  // namespace

void add_simulate_devices(CLI::App& app, int&) {
  auto* command =
      app.add_subcommand("simulate-devices", "run a rig's simulated devices around one simulated fabric until Ctrl-C");
  auto a = std::make_shared<SimulateDevicesArguments>();
  command->add_option("--config", a->configuration, "the world's file (TOML): fabric, camera, projector, devices")
      ->required();
  command->add_option("--truth", a->truth, "also write what the world is like, for comparing afterwards (JSON)");
  command->callback([a] {
    const auto configuration = hardware_sim::read_simulated_rig(a->configuration);
    if (!a->truth.empty()) files::write_json(a->truth, hardware_sim::truth_json(configuration));
    const std::atomic<bool>& stopping = stop_on_signals();
    const hardware_sim::SimulatedRig rig(configuration);
    std::printf("%s\n", rig.description().c_str());
    std::fflush(stdout);
    while (!stopping) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  });
}

}  // namespace selvedge::cli
