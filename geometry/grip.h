// How soft a mesh makes a corner that a rig grips.
//
// A sheet pulled at a point strains without bound there, and a mesh of spacing h cuts that off at h: each halving of h
// lets the corner give way by another ln 2 times the same length. Every mesh is to give way as one of the grip's size
// does: stretch and shear of what lies at the corner are multiplied by 1 / (1 + c ln(h / grip)). docs/decisions/0007.
#pragma once

#include <algorithm>
#include <cmath>

namespace selvedge::geometry {

// The factor for a mesh of this spacing.
inline double grip_softness(double spacing_m) {
  constexpr double grip_m = 6.25e-3, growth = 0.82, least = 0.25;
  return 1 / std::max(least, 1 + growth * std::log(spacing_m / grip_m));
}

}  // namespace selvedge::geometry
