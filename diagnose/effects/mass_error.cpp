#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// Mass per area, hem and weights apart. Where only motion is seen, scaling every stiffness, damping and drag alike
// absorbs it whole, and a diagnosis says that the data cannot tell.
Effect mass_error() {
  Effect effect{"mass_error",
                Side::inertial,
                "the weighed mass is wrong",
                {effect_parameter("mass_factor_less_one", "", 0, -0.5, 1, 0.1,
                                  [](model::Prediction& p, double v) { p.experiment.material.density *= 1 + v; })}};
  effect.change = Change::of_mass;
  return effect;
}

}  // namespace selvedge::diagnose::effects
