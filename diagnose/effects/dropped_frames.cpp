#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// Lost frames, spread over the recording, let the stamps fall behind more and more: a delay that grows with time.
Effect dropped_frames() {
  return {"dropped_frames",
          Side::measurement,
          "frames were lost and the later ones carry too early a stamp",
          {of_motion(effect_parameter("delay_per_second", "s/s", 0, -0.05, 0.05, 0.005,
                                      [](model::Prediction& p, double v) { p.sensor.drift = v; }))}};
}

}  // namespace selvedge::diagnose::effects
