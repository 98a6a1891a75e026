// Motion and its derivatives by parameters of the material, as lanes of one batch.
#pragma once

#include <vector>

#include "cloth/spline/simulate.h"

namespace selvedge::cloth::spline {

// One parameter and how far it is moved.
struct Direction {
  double Material::*member = nullptr;
  double step = 0;  // in the parameter's unit
};

struct Derivatives {
  Trajectory motion;
  std::vector<std::vector<Eigen::Matrix3Xd>> by;  // [direction][sample]: per unit of the parameter
  bool finite = true;
};

// Forward differences: each direction is a lane beside the motion itself, from an equilibrium of its own where the
// experiment starts at rest (sought from the motion's, so that all stay in one fold). All lanes take the same steps, so
// that what differs is the parameter alone.
Derivatives derivatives(const SplineSheet& sheet, const Experiment& experiment, const std::vector<Direction>& by,
                        const Options& options = {});

}  // namespace selvedge::cloth::spline
