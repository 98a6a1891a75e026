// What one triangle does to its three corners: in-plane forces, their damping, and air drag.
//
// Stretch and shear (Baraff & Witkin 1998, energies linear in area as Bhat et al. 2003 ask):
//   ε_u = |w_u| − 1,  s = w_u·w_v,
//   P_u = A (σ_u ŵ_u + τ w_v),  P_v = A (σ_v ŵ_v + τ w_u),
//   σ_u = k_u ε_u (1 + β|ε_u|) + c ε_v + d ε̇_u,  τ = shear s + d_s ṡ,
//   force on corner a = −(g_u[a] P_u + g_v[a] P_v).
// Drag (Bhat et al. 2003, section 3): on the triangle's mean velocity relative to the air, shared out to its corners as its mass is.
//
// R: number type of the material and the motion. G: of the flat triangle: double where the lanes are runs of
// one triangle, Lanes4 where they are four triangles of one run.
#pragma once

#include "cloth/kernel/lane_material.h"

namespace selvedge::cloth::kernel {

// Gradients (1/m) of the shape functions of corners 1 and 2; those of corner 0 are minus their sum.
template <class G>
struct FlatTriangle {
  G u1, u2, v1, v2;
  G area;  // m²
  G corner[3];  // m², parts of the area nearest to each corner, as in SheetData::vertex_area
};

// Differences of corners 1 and 2 to corner 0: exact under translation.
template <class R>
struct Sides {
  Vec3<R> one, two;
};

template <class R>
struct CornerForces {
  Vec3<R> zero, one, two;
};

// What a triangle remembers between steps: friction stresses and the strains of the relaxing branch.
template <class R>
struct MembraneMemory {
  R friction_u{}, friction_v{}, friction_shear{};  // N/m
  R crept_u{}, crept_v{}, crept_shear{};           // strain
};

template <class G, class R>
inline Vec3<R> along_u(const FlatTriangle<G>& t, const Sides<R>& s) {
  return scaled(t.u1, s.one) + scaled(t.u2, s.two);
}
template <class G, class R>
inline Vec3<R> along_v(const FlatTriangle<G>& t, const Sides<R>& s) {
  return scaled(t.v1, s.one) + scaled(t.v2, s.two);
}

template <class G, class R>
inline CornerForces<R> corner_forces(const FlatTriangle<G>& t, const Vec3<R>& pull_u, const Vec3<R>& pull_v) {
  const Vec3<R> one = scaled(t.u1, pull_u) + scaled(t.v1, pull_v), two = scaled(t.u2, pull_u) + scaled(t.v2, pull_v);
  return {one + two, Vec3<R>{} - one, Vec3<R>{} - two};
}

// velocity_sum: of the three corners. N/m².
template <class R>
inline Vec3<R> drag_per_area(const Vec3<R>& w_u, const Vec3<R>& w_v, const Vec3<R>& velocity_sum, const LaneMaterial<R>& p) {
  const Vec3<R> area_normal = cross(w_u, w_v);
  const R inverse = 1.0 / (dot(area_normal, area_normal) + 1e-300);
  const Vec3<R> relative = scaled(1.0 / 3.0, velocity_sum) - p.air;
  const R along = dot(relative, area_normal), speed2 = along * along * inverse;
  const R on_normal = p.drag_normal * square_root(speed2) / (1.0 + p.drag_fade * speed2) + p.drag_linear;
  return (-p.drag_tangent) * relative + ((p.drag_tangent - on_normal) * along * inverse) * area_normal;
}

template <class R>
inline void remember(MembraneMemory<R>& k, const LaneMaterial<R>& p, double step_s, const Vec3<R>& strain,
                     const Vec3<R>& rate) {
  const R limit = p.stretch_friction + 1e-300;
  k.friction_u += step_s * p.stretch_friction_slope * (rate.x - absolute(rate.x) * k.friction_u / limit);
  k.friction_v += step_s * p.stretch_friction_slope * (rate.y - absolute(rate.y) * k.friction_v / limit);
  k.friction_shear += step_s * p.stretch_friction_slope * (rate.z - absolute(rate.z) * k.friction_shear / limit);
  k.crept_u += step_s * p.creep_rate * (strain.x - k.crept_u);
  k.crept_v += step_s * p.creep_rate * (strain.y - k.crept_v);
  k.crept_shear += step_s * p.creep_rate * (strain.z - k.crept_shear);
}

// memory: read and advanced by step_s only where p.uses_membrane_memory.
template <class G, class R>
inline CornerForces<R> triangle_forces(const FlatTriangle<G>& t, const Sides<R>& x, const Sides<R>& v,
                                       const Vec3<R>& velocity_sum, const LaneMaterial<R>& p, MembraneMemory<R>* memory,
                                       double step_s) {
  const Vec3<R> w_u = along_u(t, x), w_v = along_v(t, x), rate_u = along_u(t, v), rate_v = along_v(t, v);
  const R length_u = norm(w_u), length_v = norm(w_v);
  const R inverse_u = 1.0 / length_u, inverse_v = 1.0 / length_v;
  // u, v and shear parts of strain and its rate.
  const Vec3<R> strain{length_u - 1.0, length_v - 1.0, dot(w_u, w_v)};
  const Vec3<R> rate{dot(w_u, rate_u) * inverse_u, dot(w_v, rate_v) * inverse_v, dot(w_u, rate_v) + dot(w_v, rate_u)};
  R sigma_u = p.stretch_u * strain.x, sigma_v = p.stretch_v * strain.y, tau = p.shear * strain.z;
  if (p.uses_stretch_extras) {
    sigma_u = sigma_u * (1.0 + p.stiffening * absolute(strain.x)) + p.coupling * strain.y;
    sigma_v = sigma_v * (1.0 + p.stiffening * absolute(strain.y)) + p.coupling * strain.x;
  }
  sigma_u += p.stretch_damping * rate.x;
  sigma_v += p.stretch_damping * rate.y;
  tau += p.shear_damping * rate.z;
  if (p.uses_membrane_memory) {
    remember(*memory, p, step_s, strain, rate);
    sigma_u += memory->friction_u + p.creep * p.stretch_u * (strain.x - memory->crept_u);
    sigma_v += memory->friction_v + p.creep * p.stretch_v * (strain.y - memory->crept_v);
    tau += memory->friction_shear + p.creep * p.shear * (strain.z - memory->crept_shear);
  }
  const R pull_along_u = t.area * sigma_u * inverse_u, pull_along_v = t.area * sigma_v * inverse_v, across = t.area * tau;
  CornerForces<R> f = corner_forces(t, pull_along_u * w_u + across * w_v, pull_along_v * w_v + across * w_u);
  const Vec3<R> drag = drag_per_area(w_u, w_v, velocity_sum, p);
  f.zero += scaled(t.corner[0], drag);
  f.one += scaled(t.corner[1], drag);
  f.two += scaled(t.corner[2], drag);
  return f;
}

// The damping alone of the velocities v, at the shape x.
template <class G, class R>
inline CornerForces<R> triangle_damping(const FlatTriangle<G>& t, const Sides<R>& x, const Sides<R>& v,
                                        const LaneMaterial<R>& p) {
  const Vec3<R> w_u = along_u(t, x), w_v = along_v(t, x), rate_u = along_u(t, v), rate_v = along_v(t, v);
  const R rate_along_u = dot(w_u, rate_u) / dot(w_u, w_u), rate_along_v = dot(w_v, rate_v) / dot(w_v, w_v);
  const R skew_rate = dot(w_u, rate_v) + dot(w_v, rate_u);
  const R damping = t.area * p.stretch_damping, across = t.area * p.shear_damping * skew_rate;
  return corner_forces(t, damping * rate_along_u * w_u + across * w_v, damping * rate_along_v * w_v + across * w_u);
}

}  // namespace selvedge::cloth::kernel
