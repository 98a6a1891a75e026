#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect bend_friction() {
  return {"bend_friction", Side::dissipative, "bending has dry friction: moments depend on the way taken",
          {material_parameter("bend_friction", "N", 0, 0, 1e-3, 4e-5, &cloth::Material::bend_friction)}};
}

}  // namespace selvedge::diagnose::effects
