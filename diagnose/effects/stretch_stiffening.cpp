#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect stretch_stiffening() {
  return {"stretch_stiffening",
          Side::elastic,
          "the fabric grows stiffer (or softer) the more it is stretched",
          {material_parameter("stretch_stiffening", "", 0, -4, 60, 3, &cloth::Material::stretch_stiffening)}};
}

}  // namespace selvedge::diagnose::effects
