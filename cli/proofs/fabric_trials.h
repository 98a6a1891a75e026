// Four simulated fabrics and their recorded trials, as the paper of 2003 has them: two static and two waving trials
// each, images of projected stripes and held corners, written to disk and read again as any recording.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/trial/trial.h"
#include "cloth/material.h"

namespace selvedge::cli {

struct TrueFabric {
  std::string name;
  cloth::Material material;
};

// linen, fleece, satin, knit: SI units, chosen to lie as far apart as the paper's.
const std::vector<TrueFabric>& true_fabrics();

struct FabricTrialOptions {
  int columns = 25;              // of the sheet that is recorded
  int frames = 50;
  double frame_rate_hz = 30;
  double noise_grey = 1.5, noise_m = 2e-4;
  unsigned seed = 1;
};

// Trials static-1, static-2 (corners 0.295 and 0.285 m apart), waving-1 and waving-2 of a 0.3 m square in `folder`.
trial::Campaign record_fabric(const TrueFabric& fabric, const std::filesystem::path& folder, const FabricTrialOptions& options = {});

}  // namespace selvedge::cli
