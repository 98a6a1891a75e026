#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// What an implicit Euler step h does to every elastic mode: damping in proportion to stiffness, with time constant h.
// Seen in motion it is a change of the material's own damping, which the base model fits as well. A dashpot behind a
// spring, where the base has one beside it, is found as 1 to 3 ms in null campaigns.
Effect integrator_damping() {
  Effect e{"integrator_damping",
           Side::numerical,
           "the integrator damps as an implicit step does",
           {of_motion(effect_parameter("step", "s", 0, 0, 0.02, 1e-3, [](model::Prediction& p, double v) {
             cloth::Material& m = p.experiment.material;
             m.stretch_damping += v * m.stretch;
             m.shear_damping += v * m.shear;
             m.bend_damping += v * m.bend;
           }))}};
  e.form = 1e-3;
  return e;
}

}  // namespace selvedge::diagnose::effects
