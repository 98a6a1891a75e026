// Simulating a recorded trial with a spline sheet: the same experiments as cloth/simulate.h takes, with control points
// (spline_sheet.h) in the place of vertices.
//
// Experiments of one call with the same times and way of holding go through the kernels side by side, each with the
// bits that it has alone. Contact is for triangles.
#pragma once

#include <vector>

#include "cloth/simulate.h"
#include "cloth/spline/spline_sheet.h"

namespace selvedge::cloth::spline {

// Of the motion; equilibria are sought in double precision.
enum class Precision { single, twofold };

struct Options {
  Precision precision = Precision::single;
  double step_s = 0;            // 0: the stable step of the stiffest lane
  double rest_change_m = 2e-6;  // settle.h
};

// The longest step that simulates each of the lanes stably, with the least work, s.
double common_step_s(const SplineSheet& sheet, const std::vector<Experiment>& lanes);

// Any number of lanes. start_shape: control points; where starts_at_rest, a shape near equilibrium to seek it from.
// A lane that diverged is run again with half the step, up to three times. Throws std::invalid_argument where lanes
// differ in start_s, sample_s, hold, or in having a guide, and where one asks for contact or added mass.
std::vector<Trajectory> simulate(const SplineSheet& sheet, const std::vector<Experiment>& lanes,
                                 const Options& options = {});

// A shape near equilibrium to start from, as cloth::hung_shape.
Eigen::Matrix3Xd hung_shape(const SplineSheet& sheet, const Experiment& experiment, double side);

}  // namespace selvedge::cloth::spline
