#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect hem() {
  return {"hem",
          Side::elastic,
          "a strip along the rim is stiffer and heavier",
          {material_parameter("hem_stiffness", "", 0, 0, 60, 3, &cloth::Material::hem_stiffness),
           material_parameter("hem_density", "kg/m²", 0, 0, 1, 0.04, &cloth::Material::hem_density)}};
}

}  // namespace selvedge::diagnose::effects
