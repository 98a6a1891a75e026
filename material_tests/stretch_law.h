// A strip of an orthotropic fabric pulled along one of its two directions, free to narrow across.
//
// The sheet's law (cloth/material.h), with ε the stretch less 1, stresses per width:
//   σ_u = k_u ε_u (1 + β |ε_u|) + ν √(k_u k_v) ε_v,   σ_v likewise;   pulled along u: σ_u = force / width, σ_v = 0;
// where β is negative as cloth/stiffening.h has it.
// Knits are pulled to several times their length, where that law does not hold. For them the same law in Green's strain
// E = (λ² − 1) / 2, which is ε where the strain is small, with a stiffening for each direction and one term more, a
// strain at which the yarns lie straight and the fabric locks:
//   S_u = k_u E_u (1 + β_u |E_u|) exp((E_u / ℓ_u)⁴) + ν √(k_u k_v) E_v,   force / width = λ_u S_u,   S_v = 0.
// Where its β is negative, 1 + β |ε| is bounded below at 0.05, as bending's softening is.
#pragma once

#include <array>
#include <limits>

#include <Eigen/Core>

namespace selvedge::material_tests {

struct StretchLaw {
  std::array<double, 2> stiffness = {1, 1};  // k_u, k_v, force per width
  double coupling = 0;                       // ν
  std::array<double, 2> stiffening = {0, 0};
  bool large = false;  // Green's strain; else the sheet's law, whose two stiffenings are one
  std::array<double, 2> locking = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  // Of a strip that is wider than its clamps the wings hardly narrow: what share of it is seen, pulled along u and v.
  std::array<double, 2> narrowing_seen = {1, 1};
};

struct Pulled {
  Eigen::ArrayXd along, across;  // stretches
};

// Stretches of a strip pulled along direction (0: u, 1: v) by forces per width ≥ 0. Stretch is looked for up to 5.
Pulled pulled(const StretchLaw& law, int direction, const Eigen::ArrayXd& force_per_width);

}  // namespace selvedge::material_tests
