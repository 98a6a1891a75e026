#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// How far the curvature must change before friction saturates differs from cloth to cloth by more than tenfold, and
// what friction does to a motion with it. Cloth has friction of all of them at once: a sum (Prandtl and Ishlinskii).
Effect bend_friction() {
  Effect e{"bend_friction",
           Side::dissipative,
           "bending has dry friction: moments depend on the way taken",
           {of_motion(material_parameter("bend_friction", "N", 0, 0, 1e-3, 4e-5, &cloth::Material::bend_friction)),
            of_motion(material_parameter("saturation_curvature", "1/m", 20, 1, 100, 10,
                                         &cloth::Material::bend_friction_curvature))}};
  e.starts = {{4e-5, 4}, {1e-4, 15}, {2e-4, 40}};
  e.starts_add = true;
  return e;
}

}  // namespace selvedge::diagnose::effects
