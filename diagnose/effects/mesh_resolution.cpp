#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// The prediction already holds what a mesh of half the spacing adds; this is how much more of the same a still
// finer one would: 1/3 to the limit of a method of second order, 1 of first order.
Effect mesh_resolution() {
  Effect effect{
      "mesh_resolution",
      Side::numerical,
      "the mesh is too coarse",
      {effect_parameter("beyond", "", 0, -0.5, 3, 0.5, [](model::Prediction& p, double v) { p.beyond_mesh = v; })}};
  effect.change = Change::of_grid;
  return effect;
}

}  // namespace selvedge::diagnose::effects
