// The equilibria of a drape. A sheet held at two points buckles to one side or the other and folds in several
// ways; each stable way is a branch. Many starts are relaxed, then the mirror images of where they ended; those
// that end alike are one branch.
#pragma once

#include <vector>

#include "cloth/simulate.h"

namespace selvedge::cloth {

struct Branch {
  Eigen::Matrix3Xd position;  // at rest, 3×N, m
  double potential_j = 0;     // of weight, stretch, shear and bending
  int starts = 0;             // how many starts ended here
};

struct BranchOptions {
  int starts = 16;            // the two hung shapes, the experiment's start_shape if it has one, and random ones
  double amplitude_m = 0.04;  // root mean square of the random shapes' distance from the hung ones
  double alike_m = 1e-3;      // root mean square distance within a branch
  unsigned seed = 1;
  Options relaxation;
};

// Lowest energy first. Starts that do not come to rest are left out.
std::vector<Branch> find_branches(const Sheet& sheet, const Experiment& experiment, const BranchOptions& options = {});

// The branch that points seen on the fabric (uv, m; NaN columns are unseen) lie nearest to: its index, and the root
// mean square distance. Throws std::invalid_argument where there is no branch or nothing is seen.
struct SeenBranch {
  size_t index = 0;
  double distance_m = 0;
};
SeenBranch branch_seen(const Sheet& sheet, const std::vector<Branch>& branches, const std::vector<Eigen::Vector2d>& uv,
                       const Eigen::Matrix3Xd& seen);

}  // namespace selvedge::cloth
