// Recorded trials of simulated fabrics as the paper of 2003 has them: a square sheet held by two corners, images of
// projected stripes and the held corners, written to disk and read again as any recording.
//
// Static: both corners still. Waving: after 0.1 s the right corner swings forwards and up as (1 − cos ωt)/2. Robot:
// after 0.1 s it swings to and fro as sin ωt, gathering over 0.4 s. Simulated with the model that is fitted, on its own
// mesh.
#pragma once

#include <filesystem>

#include "experiments/experiment_file.h"
#include "report/progress.h"

namespace selvedge::experiments {

// All trials of the protocol, below `folder` (made anew). The same protocol gives the same bytes.
trial::Campaign record_fabric(
    const Fabric& fabric, const TrialProtocol& protocol, const std::filesystem::path& folder,
    const report::ProgressCallback& progress = [](double, const std::string&) {});

}  // namespace selvedge::experiments
