#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// The segmented outline jumps from frame to frame and takes the nodes inside it along. How it jumps is seen at the held
// edge, which follows the grips (model/held_markers.h); how much of that the other nodes show, falling to nothing at
// the opposite edge, is the parameter.
Effect outline_jitter() {
  return {"outline_jitter",
          Side::measurement,
          "the tracked outline shifts, scales and tilts from frame to frame",
          {of_motion(effect_parameter("jitter_share", "", 0, 0, 1.5, 0.5,
                                      [](model::Prediction& p, double v) { p.sensor.outline_jitter = v; }))},
          AppliesTo::grids};
}

}  // namespace selvedge::diagnose::effects
