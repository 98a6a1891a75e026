#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect anisotropy() {
  return {"anisotropy",
          Side::elastic,
          "stretch or bending differs between the two directions of the fabric",
          {material_parameter("stretch_anisotropy", "", 0, -1.5, 1.5, 0.3, &cloth::Material::stretch_anisotropy),
           material_parameter("bend_anisotropy", "", 0, -1.5, 1.5, 0.3, &cloth::Material::bend_anisotropy)}};
}

}  // namespace selvedge::diagnose::effects
