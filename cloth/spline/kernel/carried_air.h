// Air that a sheet carries along its normal: mass against the accelerations along it alone.
//
// With c = added_mass / density at a control point and n the normal at its Greville point, P½ = 1 − s n nᵀ, s = 1 −
// 1/√(1 + c), stands on both sides of the inverse mass, so that it stays symmetric: a mode that moves along the normals
// has the mass (1 + c). run.air_share is s, and 0 at what a grip reads, which therefore stays where it is held; run.air
// is √s n. A lane that carries none keeps its bits. Weight is the fabric's alone.
#pragma once

#include "cloth/spline/kernel/forces.h"

namespace selvedge::cloth::spline::kernel::SELVEDGE_KIND {

// Unit normals at the Greville points times √s. Overwrites rows of scratch.
template <class V, class T>
void set_air(const Run<T>& run) {
  const int n = run.u.functions, nv = run.v.functions, field = n * nv;
  V *value = lanes<V>(run.scratch), *slope = value + 3 * n, *air = lanes<V>(run.air);
  const V* share = lanes<V>(run.air_share);
  for (int j = 0; j < nv; ++j) {
    for (int c = 0; c < 3; ++c)
      gather_both(run.v.greville_value + 4 * j, run.v.greville_slope + 4 * j,
                  lanes<V>(static_cast<const T*>(run.x)) + c * field + run.v.greville_first[j] * n, n, n, value + c * n,
                  slope + c * n);
    for (int i = 0; i < n; ++i) {
      const int first = run.u.greville_first[i], at = j * n + i;
      const Vec3<V> normal = cross(point_of(run.u.greville_slope + 4 * i, value + first, n),
                                   point_of(run.u.greville_value + 4 * i, slope + first, n));
      const V size = root(share[at]) / (root(dot(normal, normal)) + T(1e-20));
      air[at] = size * normal.x;
      air[field + at] = size * normal.y;
      air[2 * field + at] = size * normal.z;
    }
  }
}

template <class V>
inline V along_air(const V* air, const V* y, int field) {
  return fused(air[2 * field], y[2 * field], fused(air[field], y[field], air[0] * y[0]));
}

// y ← P½ y.
template <class V, class T>
void carry_air(const Run<T>& run, V* y) {
  const int field = run.u.functions * run.v.functions;
  const V* air = lanes<V>(static_cast<const T*>(run.air));
  for (int i = 0; i < field; ++i) {
    const V along = along_air(air + i, y + i, field);
    for (int c = 0; c < 3; ++c) y[c * field + i] -= along * air[c * field + i];
  }
}

}  // namespace selvedge::cloth::spline::kernel::SELVEDGE_KIND
