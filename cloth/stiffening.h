// How the stress along a thread grows with its strain: σ = k ε (1 + β |ε|), or where β is negative
// σ = k ε / (1 + |β ε|). The two have the same slope and bend at rest; a fabric that softens keeps pulling back however
// far it is stretched. A logarithm of length in the place of length is a β of −1.5.
#pragma once

#include <cmath>

namespace selvedge::cloth {

// σ / (k ε).
inline double stretch_factor(double beta, double strain) {
  const double by = beta * std::abs(strain);
  return by < 0 ? 1 / (1 - by) : 1 + by;
}

// dσ/dε / k.
inline double stretch_slope(double beta, double strain) {
  const double by = beta * std::abs(strain);
  return by < 0 ? 1 / ((1 - by) * (1 - by)) : 1 + 2 * by;
}

// Energy an area, over k.
inline double stretch_energy(double beta, double strain) {
  const double by = beta * std::abs(strain), square = strain * strain;
  if (by >= 0) return square * (0.5 + by / 3);
  if (by > -1e-3) return square * (0.5 + by * (1.0 / 3 + by * (0.25 + by / 5)));  // what rounding would spoil
  return square * (-by - std::log1p(-by)) / (by * by);
}

}  // namespace selvedge::cloth
