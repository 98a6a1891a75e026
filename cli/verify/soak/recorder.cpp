#include "cli/verify/soak/recorder.h"

#include <chrono>
#include <thread>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "capture/session/run_trial.h"
#include "hardware_sim/world/world_configuration.h"
#include "hardware_sim/simulated_rig.h"
#include "rig/clock.h"

namespace selvedge::cli {

void record_trials(const std::filesystem::path& rig_file, const std::filesystem::path& world,
                   const std::filesystem::path& trials, const std::atomic<bool>& stopping) {
  const rig::Configuration configuration = rig::Configuration::load(rig_file);
  const session::SessionPlan session = session::read_session_plan(configuration);
  const auto simulated = hardware_sim::read_simulated_rig(world).world;
  const session::RigOptics optics{simulated.camera, simulated.projector};
  const auto quiet = [](double, const std::string&) {};
  session::RigClient client(configuration);
  for (size_t i = 0; !stopping; ++i) {
    session::TrialPlan plan = session.trials[i % session.trials.size()];
    plan.name = fmt::format("trial-{:014}", rig::host_now_us());
    try {
      client.wait_until_running(session.answer_timeout_s, [](const std::string&) {});
      const auto record = session::run_trial(client, configuration, session, plan, optics, trials, quiet);
      spdlog::info("{} ({}): {} frames, {} lost", plan.name, session.trials[i % session.trials.size()].name,
                   record.frames, record.frames_lost);
    } catch (const std::exception& error) {
      spdlog::warn("{}: {}", plan.name, error.what());
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
  }
}

}  // namespace selvedge::cli
