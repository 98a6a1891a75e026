#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// What is stamped t shows the fabric at t − delay: the residual follows the velocity of every point alike.
Effect camera_delay() {
  return {"camera_delay",
          Side::measurement,
          "observations are stamped later than they were made",
          {effect_parameter("delay", "s", 0, -0.5, 0.5, 0.005,
                            [](model::Prediction& p, double v) { p.sensor.delay_s = v; })}};
}

}  // namespace selvedge::diagnose::effects
