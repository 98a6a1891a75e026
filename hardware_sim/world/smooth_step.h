// A hand's way from rest to rest.
#pragma once

#include <algorithm>

namespace selvedge::hardware_sim {

// 0 before s = 0, 1 after s = 1; speed and acceleration vanish at both ends.
inline double smooth_step(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10 + s * (-15 + 6 * s));
}

}  // namespace selvedge::hardware_sim
