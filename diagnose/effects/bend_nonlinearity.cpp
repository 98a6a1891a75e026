#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect bend_nonlinearity() {
  return {"bend_nonlinearity",
          Side::elastic,
          "bending grows stiffer (or softer) with curvature",
          {material_parameter("bend_stiffening", "m²", 0, -2e-3, 2e-2, 5e-4, &cloth::Material::bend_stiffening)}};
}

}  // namespace selvedge::diagnose::effects
