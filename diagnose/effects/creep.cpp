#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect creep() {
  return {"creep",
          Side::dissipative,
          "part of the stiffness relaxes within about a second",
          {material_parameter("creep", "", 0, 0, 4, 0.3, &cloth::Material::creep)}};
}

}  // namespace selvedge::diagnose::effects
