// The fabric that the fit's tests look for, and trials of it.
#pragma once

#include "cli/verify/proofs/simulated_trial.h"

namespace selvedge::fit {

inline cloth::Material true_material() {
  cloth::Material m;
  m.density = 0.16;
  m.stretch = 90;
  m.shear = 45;
  m.bend = 8e-5;
  m.stretch_damping = m.shear_damping = 0.03;
  m.drag_normal = 1.3;
  return m;
}

inline trial::Trial simulated_trial(const std::string& name, double amplitude_m, double seconds, unsigned seed) {
  return selvedge::simulated_trial(
      {true_material()}, {.amplitude_m = amplitude_m, .samples = static_cast<int>(seconds * 120) + 1}, name, seed);
}

}  // namespace selvedge::fit
