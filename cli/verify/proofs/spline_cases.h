// Real fabrics in motion on the grid that is chosen for them, against the same law on four times the cells.
#pragma once

#include <vector>

#include "cli/verify/proofs/real_fabrics.h"
#include "cloth/spline/chosen_grid.h"

namespace selvedge::cli {

struct SplineCase {
  DrawnFabric fabric;
  cloth::spline::ChosenGrid grid;
  int columns = 0, rows = 0;
  double cost = 0;  // CPU s per simulated s, each of a batch of full lanes
  // One a motion: one corner, both corners, edge held; mm rms of 25 markers over the first second. Infinite where a run
  // diverged.
  std::vector<double> free_mm, pulled_mm, triangles_mm;
  int triangle_columns = 0;
  double triangle_cost = 0;
};

// motions: how many of the three. duration_s: of each.
SplineCase run_spline_case(const DrawnFabric& fabric, int motions, double duration_s, double tolerance_m);

}  // namespace selvedge::cli
