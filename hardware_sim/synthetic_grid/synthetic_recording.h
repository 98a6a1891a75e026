// Made-up poses as a rig would have recorded them: the tracker's markers, the marker image and the pattern images.
#pragma once

#include <limits>
#include <vector>

#include "calib/read_images.h"
#include "hardware_sim/synthetic_grid/synthetic_images.h"
#include "hardware_sim/synthetic_grid/synthetic_poses.h"

namespace selvedge::hardware_sim {

// decoded: how many poses, from the first on, have pattern images (calibration_sequence); they take longest to make.
std::vector<calib::PoseImages> record_images(const SyntheticPoses& truth, const calib::MarkerGrid& grid,
                                             const BoardLook& look,
                                             size_t decoded = std::numeric_limits<size_t>::max());

}  // namespace selvedge::hardware_sim
