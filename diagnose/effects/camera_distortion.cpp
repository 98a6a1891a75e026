#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect camera_distortion() {
  return {"camera_distortion",
          Side::measurement,
          "the camera bends straight lines otherwise than its calibration says",
          {of_motion(effect_parameter("k1", "", 0, -0.3, 0.3, 0.02,
                                      [](model::Prediction& p, double v) { p.sensor.radial_distortion = v; }))},
          AppliesTo::images};
}

}  // namespace selvedge::diagnose::effects
