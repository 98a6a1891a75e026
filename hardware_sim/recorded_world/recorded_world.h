// Campaigns with images recorded from the simulated world by hand, without a rig: what the checks of a calibration's
// watch are held against.
//
// Trials in turn: the first hangs still, the others are waved. Each trial carries the matrices of a perfect
// calibration; from a chosen trial on the world's knock has happened, and all frames may be stamped late. m, s.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "capture/trial/trial.h"
#include "hardware_sim/world/world_configuration.h"

namespace selvedge::hardware_sim {

struct RecordingOptions {
  size_t trials = 4;
  double duration_s = 2;
  double amplitude_m = 0.05, frequency_hz = 1.2;  // of the waved corner
  double camera_rate_hz = 30, tracker_rate_hz = 120;
  double tracker_noise_m = 0.0002;
  double late_s = 0;  // frames are stamped so much after they were taken
  double stripe_period_px = 16;
  size_t knocked_trial = SIZE_MAX;  // from this one on (0 is the first) world.knock has happened
  unsigned seed = 1;                // of the tracker's noise
};

// Writes the campaign into `folder` and reads it back.
trial::Campaign record_campaign(const WorldConfiguration& world, const RecordingOptions& options,
                                const std::filesystem::path& folder);

}  // namespace selvedge::hardware_sim
