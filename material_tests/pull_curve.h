// A recorded pull as a curve: stretch along and across at given forces, while the strip is being pulled; what it loses
// on the way back; and how far pulls of one fabric lie apart.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "capture/trial/trial.h"

namespace selvedge::material_tests {

struct PullCurve {
  std::string trial;
  int number = 0, direction = 0;        // 0: along u (the warp), 1: along v
  Eigen::ArrayXd force, along, across;  // force per width (unit / m); NaN where the pull has no sample about it
  std::optional<double> loss;           // share of the work that does not come back; of pulls that come back
};

// All pulls of trials whose strips run along the warp or the weft (to a degree), at forces that all pulls of the
// direction reach. Throws BadInput naming the trial where a pull's force never rises.
std::vector<PullCurve> pull_curves(const std::vector<const trial::Trial*>& strips);

// Deviation between pulls of one direction at one force: [direction][0: along, 1: across], at least 0.003; 0.01 where
// there is one pull alone.
using Scatter = std::array<std::array<double, 2>, 2>;
Scatter scatter_of(const std::vector<PullCurve>& curves);

}  // namespace selvedge::material_tests
