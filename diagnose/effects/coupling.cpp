#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect coupling() {
  return {"coupling",
          Side::elastic,
          "stretch one way narrows the other way",
          {material_parameter("coupling", "", 0, -0.3, 0.9, 0.2, &cloth::Material::coupling)}};
}

}  // namespace selvedge::diagnose::effects
