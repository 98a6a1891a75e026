#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// How far the curvature must change before friction saturates differs from cloth to cloth by more than tenfold, and
// what friction does to a motion with it: it is fitted too.
Effect bend_friction() {
  Effect e{
      "bend_friction",
      Side::dissipative,
      "bending has dry friction: moments depend on the way taken",
      {material_parameter("bend_friction", "N", 0, 0, 1e-3, 4e-5, &cloth::Material::bend_friction),
       material_parameter("saturation_curvature", "1/m", 20, 1, 100, 10, &cloth::Material::bend_friction_curvature)}};
  e.starts = {{4e-5, 4}, {1e-4, 4}, {1e-4, 15}, {2e-4, 40}};
  return e;
}

}  // namespace selvedge::diagnose::effects
