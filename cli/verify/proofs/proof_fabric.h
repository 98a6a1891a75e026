// The knit that figures of proofs and the tests' recordings are of. Where fits begin is another one.
#pragma once

#include "cloth/material.h"

namespace selvedge::cli {

inline cloth::Material proof_fabric() {
  cloth::Material m;
  m.stretch = 110;
  m.shear = 55;
  m.bend = 5.5e-5;
  m.stretch_damping = m.shear_damping = 0.04;
  m.bend_damping = 5e-7;
  m.drag_normal = 1.05;
  return m;
}

}  // namespace selvedge::cli
