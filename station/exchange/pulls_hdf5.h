// Pulls of a strip under a camera, as HDF5 (`stitch-by-stitch`, 2024): a group a pull, with `forces` (N values), `traj`
// (points × 2 × N, px) and, where it is there, `frames` (N numbers); beside them clampSize and fabricSize, px.
//
// Seven points are tracked: 0 and 1 at the strip's sides, half way up; 2 and 3 on the fabric near the lower and upper
// clamp; 4 in its middle; 5 and 6 on the clamps. Along is the distance of 2 and 3, across that of 0 and 1.
#pragma once

#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "capture/trial/trial.h"

namespace selvedge::station {

struct PullsHdf5Options {
  std::optional<double> clamp_m;  // what clampSize is
  double frame_rate_hz = 30;
  std::pair<int, int> along = {2, 3}, across = {0, 1};  // points whose distances give the stretches
};

struct PullsOfFile {
  double width_m = 0, gauge_m = 0;  // the fabric's width (fabricSize), and the mean first distance of `along`
  std::vector<trial::Pull> pulls;
};

// Throws BadInput naming the file and what it lacks, or the option (--clamp-mm) that is missing.
PullsOfFile read_pulls_hdf5(const std::filesystem::path& path, const PullsHdf5Options& options);

}  // namespace selvedge::station
