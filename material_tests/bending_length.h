// The length that bending rigidity and weight make: (B / (ρ g))^⅓, of the size of a hanging fabric's folds.
#pragma once

#include <cmath>

namespace selvedge::material_tests {

inline constexpr double kGravity_m_s2 = 9.81;

// bend: N·m; areal_mass: kg/m².
inline double bending_length_m(double bend, double areal_mass) {
  return std::cbrt(bend / (areal_mass * kGravity_m_s2));
}

// And back: N·m.
inline double bend_of(double length_m, double areal_mass) { return areal_mass * kGravity_m_s2 * std::pow(length_m, 3); }

// A rigidity a width as instruments of the trade print it, gf·cm²/cm, of one in N·m.
inline double gram_force_cm(double bend) { return bend / 9.80665e-5; }

}  // namespace selvedge::material_tests
