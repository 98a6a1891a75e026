// What pictures and clouds err by beside the sensor.
//
// A grid hangs a little otherwise than fabric does, the same in all frames. Thousands of points show that, and each
// would count as if it told something new: an effect that bends the sheet a little stands in for it. So smooth patterns
// (Protocol::mesh_waves) lie over the depths of all pictures alike, of the size of what a finer grid changes there. No
// smooth pattern makes all of it: each depth errs by as much again, by itself. That is more than the noise of stripes,
// and parameters of the fabric would follow it (docs/decisions/0056-what-pictures-err-by.md).
//
// The outline of a scanned cloud lies between its last points and the next ones, which missed the fabric: all outline
// points, of all times, err by the same share of that.
#pragma once

#include <Eigen/Core>

#include "diagnose/windows.h"

namespace selvedge::diagnose {

struct SeenError {
  Eigen::MatrixXd lasting;   // rows × patterns, mm, each of unit variance: the same in all windows
  Eigen::VectorXd rough_mm;  // a row: by itself
};

// grid: what a finer grid changes, a row. Where there are only markers lasting has no columns and rough_mm is zero.
SeenError seen_error(const Protocol& protocol, const model::Simulation& simulation, const Windows& windows,
                     const Eigen::VectorXd& grid);

}  // namespace selvedge::diagnose
