#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect added_mass() {
  return {"added_mass",
          Side::aerodynamic,
          "air carried along adds inertia across the fabric",
          {of_motion(material_parameter("added_mass", "kg/m²", 0, 0, 0.5, 0.04, &cloth::Material::added_mass))}};
}

}  // namespace selvedge::diagnose::effects
