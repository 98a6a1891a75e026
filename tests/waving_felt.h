// A waving sheet of a few frames with images, recorded by the model itself into a folder.
#pragma once

#include <filesystem>

#include "experiments/simulated_trials.h"

namespace selvedge {

inline trial::Campaign record_waving_felt(const std::filesystem::path& folder) {
  experiments::Fabric felt;
  felt.name = "felt";
  experiments::TrialProtocol protocol;
  protocol.cells = 6;
  protocol.frames = 6;
  protocol.frame_rate_hz = 10;
  protocol.trials = {{"waved", trial::Experiment::waving, 0.29, 0.05, 1.2, 0}};
  return experiments::record_fabric(felt, protocol, folder);
}

}  // namespace selvedge
