#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// The last row is seen row_delay after the first: the residual follows velocity × image row.
Effect rolling_shutter() {
  return {"rolling_shutter",
          Side::measurement,
          "the camera reads its rows one after another",
          {of_motion(effect_parameter("row_delay", "s", 0, -0.04, 0.04, 0.01,
                                      [](model::Prediction& p, double v) { p.sensor.row_delay_s = v; }))},
          AppliesTo::images};
}

}  // namespace selvedge::diagnose::effects
