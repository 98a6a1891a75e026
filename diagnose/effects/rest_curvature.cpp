#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect rest_curvature() {
  return {"rest_curvature",
          Side::elastic,
          "the stress-free fabric is curved",
          {material_parameter("rest_curvature_u", "1/m", 0, -15, 15, 1.5, &cloth::Material::rest_curvature_u),
           material_parameter("rest_curvature_v", "1/m", 0, -15, 15, 1.5, &cloth::Material::rest_curvature_v)}};
}

}  // namespace selvedge::diagnose::effects
