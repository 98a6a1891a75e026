#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

Effect draught() {
  return {"draught",
          Side::aerodynamic,
          "the air moves steadily",
          {effect_parameter("air_x", "m/s", 0, -2, 2, 0.1,
                            [](model::Prediction& p, double v) { p.experiment.air_velocity_m_s.x() = v; }),
           effect_parameter("air_y", "m/s", 0, -2, 2, 0.1,
                            [](model::Prediction& p, double v) { p.experiment.air_velocity_m_s.y() = v; }),
           effect_parameter("air_z", "m/s", 0, -2, 2, 0.1,
                            [](model::Prediction& p, double v) { p.experiment.air_velocity_m_s.z() = v; })}};
}

}  // namespace selvedge::diagnose::effects
