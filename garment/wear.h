// A garment worn by a moving body: the simulation of one motion.
#pragma once

#include <vector>

#include "cloth/contact/solver.h"
#include "garment/pattern.h"
#include "garment/sewing.h"
#include "garment/wearer.h"
#include "report/progress.h"

namespace selvedge::garment {

struct WearOptions {
  double duration_s = 10;    // of the motion; at most what is recorded
  double frames_per_s = 30;  // kept
  report::ProgressCallback progress = [](double, const std::string&) {};
};

struct Worn {
  std::vector<double> time_s;            // of the motion
  std::vector<Eigen::Matrix3Xd> frames;  // 3×N, m
  bool finite = true;
  int frames_that_intersect = 0;  // kept frames with intersecting triangles
  double largest_strain = 0;      // along u or v, in any kept frame
  double deepest_in_body_m = 0;   // of a vertex, in any kept frame
  double simulated_s = 0;         // with the time of dressing
  double wall_s = 0;              // of the simulation alone
  cloth::contact::Statistics contact;
};

// Puts the garment on and moves. Throws BadInput where pattern and body name joints that the motion lacks.
Worn wear(const Pattern& pattern, const Garment& garment, const Wearer& wearer, const WearOptions& options = {});

}  // namespace selvedge::garment
