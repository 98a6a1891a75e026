#include "cli/verify/proofs/calibration_watch.h"

#include <cmath>

#include <fmt/format.h>

#include "cli/verify/proofs/damaged_trials.h"
#include "hardware_sim/recorded_world/recorded_world.h"
#include "station/calibration_watch.h"

namespace selvedge::cli {

namespace {

using hardware_sim::Knock;

struct WatchRun {
  hardware_sim::RecordingOptions recording;
  Knock knock;
};

station::CalibrationWatch watch(const WatchRun& run) {
  const ScratchFolder scratch;
  hardware_sim::WorldConfiguration world =
      hardware_sim::read_world(rig::Configuration::parse("", "proof", hardware_sim::world_sections()));
  world.knock = run.knock;
  world.lattice.cells_across = world.lattice.cells_down = 8;
  return station::watch_calibration(hardware_sim::record_campaign(world, run.recording, scratch.path()),
                                    [](double, const std::string&) {});
}

// The knock is found in the device that was knocked, since the right trial, and not in the other.
bool named(const calib::Drift& knocked, const calib::Drift& other, const std::string& trial) {
  return knocked.since && *knocked.since == trial && !other.since;
}

double mean_shift_px(const calib::Drift& drift, size_t from) {
  double sum = 0;
  for (size_t i = from; i < drift.trials.size(); ++i)
    sum += drift.trials[i].shift_px / static_cast<double>(drift.trials.size() - from);
  return sum;
}

void prove_drift(std::vector<Figure>& figures, const FigureOptions& options) {
  options.progress(0.1, "campaigns in which nothing moves");
  WatchRun still;
  still.recording.seed = options.seed;
  const station::CalibrationWatch quiet = watch(still);
  figures.push_back({"watch, nothing moved in 4 trials: accused", static_cast<double>(quiet.moved()), 0, "",
                     Relation::at_most, "required"});
  for (const Knock::Device device : {Knock::Device::camera, Knock::Device::projector}) {
    const bool camera = device == Knock::Device::camera;
    const char* name = camera ? "camera" : "projector";
    options.progress(camera ? 0.35 : 0.6, fmt::format("campaigns in which the {} is knocked", name));
    const double turn_deg = camera ? 0.3 : 0.12, focal_px = camera ? 1060 : 2575;
    WatchRun run;
    run.recording.seed = options.seed + 1;
    run.recording.knocked_trial = 2;
    run.knock = {device, {turn_deg, 0, 0}};
    const station::CalibrationWatch found = watch(run);
    const calib::Drift& drift = camera ? found.camera : found.projector;
    figures.push_back(
        {fmt::format("watch, {} turned by {} degrees before the third trial: named with that trial, and it alone", name,
                     turn_deg),
         static_cast<double>(named(drift, camera ? found.projector : found.camera, "waving-2")), 1, "",
         Relation::at_least, "required"});
    figures.push_back({fmt::format("watch, {}: shift found beside the true one", name), mean_shift_px(drift, 2),
                       turn_deg * M_PI / 180 * focal_px, "px", Relation::shown, "truth of the simulated world"});
  }
}

void prove_late_frames(std::vector<Figure>& figures, const FigureOptions& options) {
  for (const auto& [what, amplitude_m, frequency_hz] :
       {std::tuple("waved by 50 mm at 1.2 Hz", 0.05, 1.2), std::tuple("gently, 35 mm at 0.9 Hz", 0.035, 0.9)}) {
    options.progress(0.85, "late frames");
    WatchRun run;
    run.recording = {.trials = 2,
                     .duration_s = 3,
                     .amplitude_m = amplitude_m,
                     .frequency_hz = frequency_hz,
                     .late_s = 0.011,
                     .seed = options.seed + 2};
    const calib::TimeOffset delay = watch(run).trials[1].delay;
    const double late_ms = delay.known ? -1e3 * delay.offset_s : std::nan("");
    figures.push_back({fmt::format("watch, frames 11 ms late, corner {}: lateness found beside the true one", what),
                       late_ms, 11, "ms", Relation::shown, "truth of the simulated world"});
    figures.push_back({fmt::format("watch, corner {}: standard deviation stated", what), 1e3 * delay.sd_s, 2.5, "ms",
                       Relation::at_most, "a quarter of the delay that matters"});
    figures.push_back({fmt::format("watch, corner {}: error over stated deviation", what),
                       std::abs(late_ms - 11) / (1e3 * delay.sd_s), 3, "", Relation::at_most, "required"});
  }
}

}  // namespace

std::vector<Figure> prove_calibration_watch(const FigureOptions& options) {
  std::vector<Figure> figures;
  prove_drift(figures, options);
  prove_late_frames(figures, options);
  return figures;
}

}  // namespace selvedge::cli
