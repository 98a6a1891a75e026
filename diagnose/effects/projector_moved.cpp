#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect projector_moved() {
  return {"projector_moved",
          Side::measurement,
          "the projector was moved after the calibration",
          {of_motion(effect_parameter("shift_x", "m", 0, -0.02, 0.02, 0.002,
                                      [](model::Prediction& p, double v) { p.sensor.projector_shift_m.x() = v; })),
           of_motion(effect_parameter("shift_y", "m", 0, -0.02, 0.02, 0.002,
                                      [](model::Prediction& p, double v) { p.sensor.projector_shift_m.y() = v; })),
           of_motion(effect_parameter("shift_z", "m", 0, -0.02, 0.02, 0.002,
                                      [](model::Prediction& p, double v) { p.sensor.projector_shift_m.z() = v; }))},
          AppliesTo::images};
}

}  // namespace selvedge::diagnose::effects
