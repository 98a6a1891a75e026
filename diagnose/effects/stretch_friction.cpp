#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect stretch_friction() {
  return {"stretch_friction",
          Side::dissipative,
          "stretch and shear have dry friction",
          {material_parameter("stretch_friction", "N/m", 0, 0, 10, 0.3, &cloth::Material::stretch_friction)}};
}

}  // namespace selvedge::diagnose::effects
