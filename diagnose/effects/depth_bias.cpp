#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// All distances from the camera come out longer by a share: the residual lies along the rays.
Effect depth_bias() {
  return {"depth_bias",
          Side::measurement,
          "the camera measures distances too long or too short",
          {of_motion(effect_parameter("depth_share", "m/m", 0, -0.1, 0.1, 0.003,
                                      [](model::Prediction& p, double v) { p.sensor.depth_bias = v; }))},
          AppliesTo::distances};
}

}  // namespace selvedge::diagnose::effects
