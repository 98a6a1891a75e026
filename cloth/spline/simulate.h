// Simulating a recorded trial with a spline sheet: the same experiments as cloth/simulate.h takes, with control points
// (spline_sheet.h) in the place of vertices.
//
// Experiments of one call go through the kernels side by side, of whatever times, each with the bits that it has alone
// at the same step. Contact is for triangles.
#pragma once

#include <vector>

#include "cloth/simulate.h"
#include "cloth/spline/spline_sheet.h"

namespace selvedge::cloth::spline {

// Of the motion; equilibria are sought in double precision.
enum class Precision { single, twofold };

// That go side by side on this processor.
int most_lanes(Precision precision);

struct Options {
  Precision precision = Precision::single;
  double step_s = 0;            // 0: the stable step of the stiffest lane
  double rest_change_m = 2e-6;  // settle.h
  double shortest_step_s = 0;   // a lane that is stable with shorter ones only is not run: it counts as diverged
};

// The longest step that simulates each of the lanes that are run stably, with the least work, s.
double common_step_s(const SplineSheet& sheet, const std::vector<Experiment>& lanes, const Options& options = {});

// Any number of lanes. start_shape: control points; where starts_at_rest, a shape near equilibrium to seek it from.
// A lane that diverged is run again with half the step, up to three times; what diverges even so, or is not run, has
// samples that are not finite. Throws std::invalid_argument where lanes differ in the way of holding, and where one
// asks for contact; Stopped where one is stopped, as relax() does.
std::vector<Trajectory> simulate(const SplineSheet& sheet, const std::vector<Experiment>& lanes,
                                 const Options& options = {});

// Equilibria of the lanes from their start shapes.
std::vector<Rest> relax(const SplineSheet& sheet, const std::vector<Experiment>& lanes, const Options& options = {});

// A shape near equilibrium to start from, as cloth::hung_shape.
Eigen::Matrix3Xd hung_shape(const SplineSheet& sheet, const Experiment& experiment, double side);

}  // namespace selvedge::cloth::spline
