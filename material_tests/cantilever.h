// Bending of a fabric from strips that hang over an edge.
//
// Strips of one direction share a linear and a second-order rigidity (heavy_strip.h). What is compared: distances of a
// midline's points from the simulated strip; of a strip without a midline the instrument's bending length (ISO 9073-7).
// Directions are joined by the law of cloth/material.h, at an angle a from the warp
//   B(a) = bend (e^b cos⁴a + 2 cos²a sin²a + e^−b sin⁴a),  b: bend_anisotropy.
#pragma once

#include <vector>

#include "capture/trial/trial.h"
#include "material_tests/answer.h"
#include "material_tests/heavy_strip.h"

namespace selvedge::material_tests {

// Of the strips of one direction.
struct DirectionBend {
  double angle_deg = 0;  // 0 to 90
  BendingLaw law;
  Eigen::Matrix2d covariance;  // of ln B and B₂ / B (m)
  bool second_order_is_seen = false;
  double rms_m = 0;  // of midlines; 0 where there are none
};

// Trials of kind cantilever, of one fabric, at one angle (modulo its mirror image). Throws BadInput naming the trial
// that no strip fits.
DirectionBend fit_direction(const std::vector<const trial::Trial*>& strips);

// All strips of a fabric: parameters bend, bend_anisotropy and bend_stiffening, as far as the strips show them, and
// reported for each direction rigidity, second-order rigidity, bending length and the instrument's.
Answer fit_cantilever(const std::vector<const trial::Trial*>& strips);

}  // namespace selvedge::material_tests
