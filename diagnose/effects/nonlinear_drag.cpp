#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect nonlinear_drag() {
  return {"nonlinear_drag",
          Side::aerodynamic,
          "drag grows with the square of the speed",
          {of_motion(material_parameter("drag_normal", "kg/m³", 0, 0, 20, 0.5, &cloth::Material::drag_normal)),
           of_motion(material_parameter("drag_fade", "s²/m²", 0, 0, 20, 0.2, &cloth::Material::drag_fade))},
          AppliesTo::simple_drag};
}

}  // namespace selvedge::diagnose::effects
