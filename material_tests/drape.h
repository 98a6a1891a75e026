// Where a disc comes to rest: one fabric has several stable drapes, of as many folds as one begins with.
#pragma once

#include "cloth/material.h"
#include "material_tests/disc_sheet.h"

namespace selvedge::material_tests {

struct Drape {
  Eigen::Matrix3Xd control;
  bool at_rest = false;  // false: no minimum was reached; control is then where the search ended
  double energy_j = 0;
  int steps = 0;
};

struct RestOptions {
  double change_m = 1e-6;  // at rest where the next step would move no control point by this
  int most_steps = 400;
  double inertia_per_s2 = 1e3;  // mass added to the curvature at first, by this; less where the start is near
};

// Newton's steps along the energy, with inertia where its curvature is not positive.
Drape come_to_rest(const DiscSheet& sheet, const cloth::Material& material, const Eigen::Matrix3Xd& start,
                   const RestOptions& options = {});

// A hanging shape with that many even folds, the first of them at phase_rad: to begin a search with. droop_rad: how far
// the rim points down.
Eigen::Matrix3Xd folded(const DiscSheet& sheet, int folds, double phase_rad = 0, double droop_rad = 1.0);

// A hanging shape whose rim, seen from above, has these radii at even angles from the x axis.
Eigen::Matrix3Xd hanging(const DiscSheet& sheet, const Eigen::VectorXd& radius_m);

// The drape whose folds are those of an outline from above: as many and where they are. First of fabric that yields ten
// times as much, which takes half the steps and keeps the folds; then of the fabric itself. Folds slide easily: the
// search ends where a step would move nothing by 0.2 mm, as a little friction would hold them.
Drape drape_like(const DiscSheet& sheet, const cloth::Material& material, const Eigen::VectorXd& radius_m);

}  // namespace selvedge::material_tests
