#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// A tracker that smooths over time without a delay: what is seen is the mean over a Gaussian, so that the residual
// follows acceleration. A smoothing that lags is this beside a camera_delay.
Effect smoothing() {
  return {"smoothing",
          Side::measurement,
          "the tracker smooths over time",
          {of_motion(effect_parameter("smoothing_variance", "s²", 0, 0, 0.01, 1e-4,
                                      [](model::Prediction& p, double v) { p.sensor.smoothing_s2 = v; }))},
          AppliesTo::points};
}

}  // namespace selvedge::diagnose::effects
