#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// The segmented outline lies inside the fabric's edge, and the nodes of a grid inside it as far.
Effect outline_erosion() {
  return {"outline_erosion",
          Side::measurement,
          "the seen outline lies inside the fabric's edge",
          {of_motion(effect_parameter("erosion", "m", 0, 0, 0.03, 0.002,
                                      [](model::Prediction& p, double v) { p.sensor.outline_erosion_m = v; }))},
          AppliesTo::outlines};
}

}  // namespace selvedge::diagnose::effects
