#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// Green's strain, of which σ = k ε (1 + 1.5 ε), is found as 2 to 4 in null campaigns.
Effect stretch_stiffening() {
  Effect e{"stretch_stiffening",
           Side::elastic,
           "the fabric grows stiffer (or softer) the more it is stretched",
           {material_parameter("stretch_stiffening", "", 0, -4, 60, 3, &cloth::Material::stretch_stiffening)}};
  e.form = 3;
  return e;
}

}  // namespace selvedge::diagnose::effects
