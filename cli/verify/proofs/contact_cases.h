// Scenes in which fabric meets itself and a body, from a seed each; for `prove contact`, `bench contact` and tests.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "cloth/contact/solver.h"
#include "cloth/simulate.h"

namespace selvedge::cli {

struct ContactScene {
  geometry::TriangleMesh mesh;
  cloth::contact::Body body;
  cloth::contact::Options options;
  cloth::Experiment experiment;  // without its step filter
};

struct ContactOutcome {
  cloth::Trajectory trajectory;
  cloth::contact::Statistics statistics;
  int intersections = 0;  // most pairs of intersecting triangles at any sample
  double wall_s = 0;
};

// A sheet of 0.3 m dropped, turned and tilted, over a thin rod; the floor lies a little below.
ContactScene sheet_over_rod(unsigned seed, int columns, double duration_s);

// A sheet folded over onto itself, a little askew, dropped on the floor.
ContactScene folded_sheet(unsigned seed, int columns, double duration_s);

// A swatch of 0.3 m hung by two corners, one of them moved 10 cm peak to peak at 1.5 Hz.
ContactScene waved_swatch(int columns, double duration_s);

// A patch laid on a plane inclined by angle_rad.
ContactScene patch_on_incline(double angle_rad, double friction, double duration_s);

// with_contact: false leaves the step filter out altogether.
ContactOutcome run_contact_scene(const ContactScene& scene, bool with_contact = true,
                                 const cloth::Options& options = {});

}  // namespace selvedge::cli
