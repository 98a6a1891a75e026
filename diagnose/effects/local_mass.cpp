#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// A small weight (a Gaussian of 12 mm) somewhere on the fabric. Where it sits means nothing while it weighs nothing,
// so several places are tried.
Effect local_mass() {
  Effect e{"local_mass",
           Side::inertial,
           "a small weight sits somewhere on the fabric",
           {material_parameter("local_mass", "kg", 0, 0, 0.02, 4e-4, &cloth::Material::local_mass_kg),
            material_parameter("local_u", "m", 0.15, 0.01, 0.6, 0.05, &cloth::Material::local_u_m),
            material_parameter("local_v", "m", 0.25, 0.01, 0.6, 0.05, &cloth::Material::local_v_m)}};
  for (const double v : {0.06, 0.15, 0.24, 0.29})
    for (const double u : {0.02, 0.09, 0.15, 0.21, 0.28}) e.starts.push_back({4e-4, u, v});
  return e;
}

}  // namespace selvedge::diagnose::effects
