// What the fabric and the air do at one point of the surface (material.h has the law; the same as
// cloth/kernel/triangle.h).
#pragma once

#include "cloth/spline/kernel/lanes.h"
#include "cloth/spline/kernel/tables.h"

namespace selvedge::cloth::spline::kernel::SELVEDGE_KIND {

// The materials of all lanes.
template <class V>
struct LaneMaterial {
  const V* row;
  const V& operator[](Row r) const { return row[r]; }
  Vec3<V> air() const { return {row[kAirX], row[kAirY], row[kAirZ]}; }
};

template <class V, class T>
LaneMaterial<V> material_of(const Run<T>& run) {
  return {reinterpret_cast<const V*>(run.material)};
}

// First derivatives of position and velocity, and the velocity itself.
template <class V>
struct PointMotion {
  Vec3<V> x_u, x_v, rate_u, rate_v, velocity;
};

// What a point pulls with, N per width and N/m², times its weight: at the slopes along u and v, and at the value.
template <class V>
struct PointPull {
  Vec3<V> u, v, value;
};

// How a point lies, kept for the stages of damping.
template <class V>
struct KeptPoint {
  Vec3<V> x_u, x_v;
  V share_u, share_v, share_shear;  // weight · damping / |w|², weight · damping
};

// Each lane's e^x.
template <class T, class V>
inline V exponential(V x) {
  constexpr int lanes = sizeof(V) / sizeof(T);
  for (int i = 0; i < lanes; ++i) x[i] = sizeof(T) == 4 ? __builtin_expf(x[i]) : __builtin_exp(x[i]);
  return x;
}

// Dahl's law over one step, as cloth/kernel/lane_material.h.
template <class T, class V>
inline void slide(V& moment, const V& q, const V& rate, const V& slope, const V& limit, T step_s) {
  const V most = limit + T(1e-30);
  if (step_s < 0) {
    const V size = limit * (T(1) - exponential<T, V>(-slope * absolute(q) / most));
    moment = q < 0 ? -size : size;
  } else {
    moment += step_s * slope * (rate - absolute(rate) * moment / most);
  }
}

// Friction and creep of the membrane; adds their stresses to sigma.
template <class T, class V>
inline void remember(V* memory, const LaneMaterial<V>& m, T step_s, const Vec3<V>& strain, const Vec3<V>& rate,
                     Vec3<V>& sigma) {
  const V slope = m[kStretchFrictionSlope], limit = m[kStretchFriction];
  slide<T>(memory[0], strain.x, rate.x, slope, limit, step_s);
  slide<T>(memory[1], strain.y, rate.y, slope, limit, step_s);
  slide<T>(memory[2], strain.z, rate.z, slope, limit, step_s);
  const V share = step_s < 0 ? same<V>(T(1)) : step_s * m[kCreepRate];
  memory[3] += share * (strain.x - memory[3]);
  memory[4] += share * (strain.y - memory[4]);
  memory[5] += share * (strain.z - memory[5]);
  sigma.x += memory[0] + m[kCreep] * m[kStretchU] * (strain.x - memory[3]);
  sigma.y += memory[1] + m[kCreep] * m[kStretchV] * (strain.y - memory[4]);
  sigma.z += memory[2] + m[kCreep] * m[kShear] * (strain.z - memory[5]);
}

// memory, kept: null where not asked for.
template <class T, class V>
[[gnu::always_inline]] inline PointPull<V> point_pull(const PointMotion<V>& p, const LaneMaterial<V>& m,
                                                      const V& weight, V* memory, T step_s, KeptPoint<V>* kept) {
  const Vec3<V> normal = cross(p.x_u, p.x_v);
  const V length_u = root(dot(p.x_u, p.x_u)), length_v = root(dot(p.x_v, p.x_v)), normal2 = dot(normal, normal);
  // One division for three reciprocals.
  const V both = length_u * length_v, shared = T(1) / fused(both, normal2, same<V>(T(1e-30)));
  const V inverse_u = shared * length_v * normal2, inverse_v = shared * length_u * normal2,
          inverse_normal2 = shared * both;
  const Vec3<V> strain{length_u - T(1), length_v - T(1), dot(p.x_u, p.x_v)};
  const Vec3<V> rate{dot(p.x_u, p.rate_u) * inverse_u, dot(p.x_v, p.rate_v) * inverse_v,
                     dot(p.x_u, p.rate_v) + dot(p.x_v, p.rate_u)};
  // cloth/stiffening.h, with one division for both.
  const V far_u = absolute(strain.x), far_v = absolute(strain.y), softer_u = fused(m[kSoftening], far_u, same<V>(T(1))),
          softer_v = fused(m[kSoftening], far_v, same<V>(T(1))), softer = T(1) / (softer_u * softer_v);
  Vec3<V> sigma{m[kStretchU] * strain.x * fused(m[kStiffening], far_u, same<V>(T(1))) * (softer * softer_v) +
                    m[kCoupling] * strain.y,
                m[kStretchV] * strain.y * fused(m[kStiffening], far_v, same<V>(T(1))) * (softer * softer_u) +
                    m[kCoupling] * strain.x,
                m[kShear] * strain.z};
  if (memory) remember(memory, m, step_s, strain, rate, sigma);
  sigma.x = fused(m[kStretchDamping], rate.x, sigma.x);
  sigma.y = fused(m[kStretchDamping], rate.y, sigma.y);
  sigma.z = fused(m[kShearDamping], rate.z, sigma.z);
  if (kept) {
    const V damping = weight * m[kStretchDamping];
    *kept = {p.x_u, p.x_v, damping * inverse_u * inverse_u, damping * inverse_v * inverse_v, weight * m[kShearDamping]};
  }
  const V along_u = weight * sigma.x * inverse_u, along_v = weight * sigma.y * inverse_v, across = weight * sigma.z;
  // Drag of Bhat et al. 2003, per flat area.
  const Vec3<V> relative = p.velocity - m.air();
  const V along = dot(relative, normal), speed2 = along * along * inverse_normal2;
  const V on_normal = m[kDragNormal] * root(speed2) / fused(m[kDragFade], speed2, same<V>(T(1))) + m[kDragLinear];
  return {add_scaled(along_u, p.x_u, across * p.x_v), add_scaled(along_v, p.x_v, across * p.x_u),
          add_scaled(weight * (m[kDragTangent] - on_normal) * along * inverse_normal2, normal,
                     (-weight * m[kDragTangent]) * relative)};
}

// Damping alone of the velocities' slopes.
template <class V>
inline PointPull<V> point_damping(const KeptPoint<V>& k, const Vec3<V>& rate_u, const Vec3<V>& rate_v) {
  const V along_u = k.share_u * dot(k.x_u, rate_u), along_v = k.share_v * dot(k.x_v, rate_v);
  const V across = k.share_shear * (dot(k.x_u, rate_v) + dot(k.x_v, rate_u));
  return {add_scaled(along_u, k.x_u, across * k.x_v), add_scaled(along_v, k.x_v, across * k.x_u), Vec3<V>{}};
}

// Second derivatives of a field at a point.
template <class V>
struct Seconds {
  Vec3<V> uu, uv, vv;
};

// What bending adds at a point to three even rigidities: softening or stiffening, hems, rest curvature, friction
// (cloth/kernel/bending.h). factor: of the rigidity, null: 1. memory: three numbers, null without friction.
template <class T, class V>
inline Seconds<V> moments_beside_even(const Seconds<V>& shape, const Seconds<V>& rate, const Vec3<V>& normal,
                                      const LaneMaterial<V>& m, const V* factor, V* memory, T step_s,
                                      bool uses_normals) {
  const V squared = dot(shape.uu, shape.uu) + T(2) * dot(shape.uv, shape.uv) + dot(shape.vv, shape.vv);
  const V linear = fused(m[kBendStiffening], squared, same<V>(T(1))), least = same<V>(T(0.05));
  V stiff = linear > least ? linear : least;
  if (factor) stiff *= *factor;
  stiff -= T(1);
  Seconds<V> moment{(m[kBendUU] * stiff) * shape.uu, (m[kBendUV] * stiff) * shape.uv, (m[kBendVV] * stiff) * shape.vv};
  if (!uses_normals) return moment;
  V bend_u = -m[kBendUU] * m[kRestU], bend_v = -m[kBendVV] * m[kRestV], twist{};
  if (memory) {
    const V slope = m[kBendFrictionSlope], limit = m[kBendFriction];
    slide<T>(memory[0], dot(shape.uu, normal), dot(rate.uu, normal), slope, limit, step_s);
    slide<T>(memory[1], dot(shape.uv, normal), dot(rate.uv, normal), slope, limit, step_s);
    slide<T>(memory[2], dot(shape.vv, normal), dot(rate.vv, normal), slope, limit, step_s);
    bend_u += memory[0];
    twist += memory[1];
    bend_v += memory[2];
  }
  return {add_scaled(bend_u, normal, moment.uu), add_scaled(twist, normal, moment.uv),
          add_scaled(bend_v, normal, moment.vv)};
}

}  // namespace selvedge::cloth::spline::kernel::SELVEDGE_KIND
