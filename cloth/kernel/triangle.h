// What one triangle does to its three corners: in-plane forces, their damping, and air drag.
//
// Stretch and shear (Baraff & Witkin 1998, energies linear in area as Bhat et al. 2003 ask):
//   ε_u = |w_u| − 1,  s = w_u·w_v,
//   P_u = A (σ_u ŵ_u + τ w_v),  P_v = A (σ_v ŵ_v + τ w_u),
//   σ_u = k_u ε_u (1 + β|ε_u|) + c ε_v + d ε̇_u,  τ = shear s + d_s ṡ,
//   force on corner a = −(g_u[a] P_u + g_v[a] P_v).
// Drag (Bhat et al. 2003, section 3): on the triangle's mean velocity relative to the air, shared out to its corners as
// its mass is.
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
  G area;       // m², that stretch and shear act on
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
  return add_scaled(t.u2, s.two, scaled(t.u1, s.one));
}
template <class G, class R>
inline Vec3<R> along_v(const FlatTriangle<G>& t, const Sides<R>& s) {
  return add_scaled(t.v2, s.two, scaled(t.v1, s.one));
}

template <class G, class R>
inline CornerForces<R> corner_forces(const FlatTriangle<G>& t, const Vec3<R>& pull_u, const Vec3<R>& pull_v) {
  const Vec3<R> one = add_scaled(t.u1, pull_u, scaled(t.v1, pull_v)),
                two = add_scaled(t.u2, pull_u, scaled(t.v2, pull_v));
  return {one + two, Vec3<R>{} - one, Vec3<R>{} - two};
}

// How a triangle lies, kept from the forces for the stages of damping. Lanes of runs keep the shares alone and find
// w_u, w_v again: reading them back from beyond the nearest cache would take longer.
template <class R>
struct DampingShares {
  R u, v;  // N·s: area · stretch_damping / |w|²
};
template <class R>
struct Frame {
  Vec3<R> w_u, w_v;
  DampingShares<R> share;
};
template <class R>
inline void keep(const Vec3<R>& w_u, const Vec3<R>& w_v, const DampingShares<R>& share, Frame<R>& to) {
  to = {w_u, w_v, share};
}
template <class R>
inline void keep(const Vec3<R>&, const Vec3<R>&, const DampingShares<R>& share, DampingShares<R>& to) {
  to = share;
}

// velocity_sum: of the three corners; inverse: 1/|normal|² of normal = w_u × w_v. N/m².
template <class R>
inline Vec3<R> drag_per_area(const Vec3<R>& normal, const R& inverse, const Vec3<R>& velocity_sum,
                             const LaneMaterial<R>& p) {
  const Vec3<R> relative = scaled(1.0 / 3.0, velocity_sum) - p.air;
  const R along = dot(relative, normal), speed2 = along * along * inverse;
  const R on_normal = p.drag_normal * square_root(speed2) / (1.0 + p.drag_fade * speed2) + p.drag_linear;
  return add_scaled((p.drag_tangent - on_normal) * along * inverse, normal, (-p.drag_tangent) * relative);
}

template <class R>
inline void remember(MembraneMemory<R>& k, const LaneMaterial<R>& p, double step_s, const Vec3<R>& strain,
                     const Vec3<R>& rate) {
  const R slope = p.stretch_friction_slope, limit = p.stretch_friction;
  slide(k.friction_u, strain.x, rate.x, slope, limit, step_s);
  slide(k.friction_v, strain.y, rate.y, slope, limit, step_s);
  slide(k.friction_shear, strain.z, rate.z, slope, limit, step_s);
  const R share = step_s == kBroughtFromFlat ? broadcast<R>(1) : step_s * p.creep_rate;
  k.crept_u += share * (strain.x - k.crept_u);
  k.crept_v += share * (strain.y - k.crept_v);
  k.crept_shear += share * (strain.z - k.crept_shear);
}

// memory: read and advanced by step_s only where p.uses_membrane_memory. frame: filled where not null. longer: added to
// the strains, where not null; stress: filled with a third of the area times the stresses that do not damp, likewise.
template <class G, class R, class Kept>
[[gnu::always_inline]] inline CornerForces<R> triangle_forces(const FlatTriangle<G>& t, const Sides<R>& x,
                                                              const Sides<R>& v, const Vec3<R>& velocity_sum,
                                                              const LaneMaterial<R>& p, MembraneMemory<R>* memory,
                                                              double step_s, Kept* frame, const Vec3<R>* longer,
                                                              Vec3<R>* stress) {
  const Vec3<R> w_u = along_u(t, x), w_v = along_v(t, x), rate_u = along_u(t, v), rate_v = along_v(t, v);
  const Vec3<R> normal = cross(w_u, w_v);
  const R length_u = norm(w_u), length_v = norm(w_v), normal2 = dot(normal, normal);
  // One division for three reciprocals.
  const R both = length_u * length_v, shared = 1.0 / fused(both, normal2, broadcast<R>(1e-300));
  const R inverse_u = shared * length_v * normal2, inverse_v = shared * length_u * normal2,
          inverse_normal2 = shared * both;
  // u, v and shear parts of strain and its rate.
  Vec3<R> strain{length_u - 1.0, length_v - 1.0, dot(w_u, w_v)};
  if (longer) strain += {longer->x, longer->z, longer->y};
  const Vec3<R> rate{dot(w_u, rate_u) * inverse_u, dot(w_v, rate_v) * inverse_v, dot(w_u, rate_v) + dot(w_v, rate_u)};
  R sigma_u = p.stretch_u * strain.x, sigma_v = p.stretch_v * strain.y, tau = p.shear * strain.z;
  if (p.uses_stretch_extras) {
    // cloth/stiffening.h
    const R far_u = absolute(strain.x), far_v = absolute(strain.y);
    sigma_u = sigma_u * (1.0 + p.stiffening * far_u) / (1.0 + p.softening * far_u) + p.coupling * strain.y;
    sigma_v = sigma_v * (1.0 + p.stiffening * far_v) / (1.0 + p.softening * far_v) + p.coupling * strain.x;
  }
  if (p.uses_membrane_memory) {
    remember(*memory, p, step_s, strain, rate);
    sigma_u += memory->friction_u + p.creep * p.stretch_u * (strain.x - memory->crept_u);
    sigma_v += memory->friction_v + p.creep * p.stretch_v * (strain.y - memory->crept_v);
    tau += memory->friction_shear + p.creep * p.shear * (strain.z - memory->crept_shear);
  }
  if (stress) *stress = scaled(1.0 / 3.0 * t.area, Vec3<R>{sigma_u, tau, sigma_v});
  sigma_u = fused(p.stretch_damping, rate.x, sigma_u);
  sigma_v = fused(p.stretch_damping, rate.y, sigma_v);
  tau = fused(p.shear_damping, rate.z, tau);
  if (frame) {
    const R damping = t.area * p.stretch_damping;
    keep(w_u, w_v, DampingShares<R>{damping * inverse_u * inverse_u, damping * inverse_v * inverse_v}, *frame);
  }
  const R pull_along_u = t.area * sigma_u * inverse_u, pull_along_v = t.area * sigma_v * inverse_v,
          across = t.area * tau;
  CornerForces<R> f =
      corner_forces(t, add_scaled(pull_along_u, w_u, across * w_v), add_scaled(pull_along_v, w_v, across * w_u));
  const Vec3<R> drag = drag_per_area(normal, inverse_normal2, velocity_sum, p);
  f.zero = add_scaled(t.corner[0], drag, f.zero);
  f.one = add_scaled(t.corner[1], drag, f.one);
  f.two = add_scaled(t.corner[2], drag, f.two);
  return f;
}

// The damping alone of the velocities v.
template <class G, class R>
inline CornerForces<R> triangle_damping(const FlatTriangle<G>& t, const Frame<R>& k, const Sides<R>& v,
                                        const LaneMaterial<R>& p) {
  const Vec3<R> rate_u = along_u(t, v), rate_v = along_v(t, v);
  const R pull_along_u = k.share.u * dot(k.w_u, rate_u), pull_along_v = k.share.v * dot(k.w_v, rate_v);
  const R across = t.area * p.shear_damping * (dot(k.w_u, rate_v) + dot(k.w_v, rate_u));
  return corner_forces(t, add_scaled(pull_along_u, k.w_u, across * k.w_v),
                       add_scaled(pull_along_v, k.w_v, across * k.w_u));
}

}  // namespace selvedge::cloth::kernel
