// Real fabrics in motion on the grid that a fit takes for them, against the same law on four times the cells with
// half the step, or on the next finer grid (twice the cells) where four times would be more than 40 a side.
#pragma once

#include <string>
#include <vector>

#include "cli/verify/proofs/real_fabrics.h"

namespace selvedge::cli {

// mm rms of 25 markers over the motion; infinite where a run diverged or no equilibrium was found.
struct MotionErrors {
  std::string motion;
  int cells = 0, reference_cells = 0;  // along the width
  double finer_moves_mm = 0;           // what the next finer grid moved this and the motions held alike
  double rest_mm = 0;                  // at rest alone
  double other_rest_mm = 0;  // on the reference's grid alone: between its equilibrium and the one found from the grid's
  double free_mm = 0, pulled_mm = 0;
  // Of the next finer grid: how fast the error falls; 0 where that is the reference.
  double finer_free_mm = 0;
};

struct SplineCase {
  DrawnFabric fabric;
  double bending_length_m = 0;
  std::vector<MotionErrors> motions;
  double cost = 0;  // CPU s per simulated s of the first motion, each of a batch of full lanes
  // Of the first motion, pulled alike, alone; 0 columns: not run.
  int triangle_columns = 0;
  double triangles_mm = 0, triangle_cost = 0;
  double wall_s = 0;
};

// Three motions (one corner, both corners, the held edge), or the first alone; duration_s: of each. Those held alike
// share a grid, as the trials of a campaign do. Grid and reference start in one fold: from the reference's equilibrium,
// the grid from its own beside that.
SplineCase run_spline_case(const DrawnFabric& fabric, bool first_alone, double duration_s, bool with_triangles);

}  // namespace selvedge::cli
