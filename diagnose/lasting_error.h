// What errs alike in all windows of pictures and clouds, and so lasts where everything else averages out.
//
// A grid hangs a little otherwise than fabric does, the same in all frames. Thousands of points show that, and each
// would count as if it told something new: an effect that bends the sheet a little stands in for it. So smooth patterns
// (Protocol::mesh_waves) lie over the depths of all pictures alike, of the size of what a finer grid changes there.
//
// The outline of a scanned cloud lies between its last points and the next ones, which missed the fabric: all outline
// points, of all times, err by the same share of that.
#pragma once

#include <Eigen/Core>

#include "diagnose/windows.h"

namespace selvedge::diagnose {

// grid: what a finer grid changes, a row. Rows × patterns, mm, each of unit variance; no columns where there are only
// markers.
Eigen::MatrixXd lasting_error(const Protocol& protocol, const model::Simulation& simulation, const Windows& windows,
                              const Eigen::VectorXd& grid);

}  // namespace selvedge::diagnose
