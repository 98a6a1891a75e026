// In-plane forces and air drag of the triangles, one pass over each.
//
// Stretch and shear (Baraff & Witkin 1998, energies linear in area as Bhat et al. 2003 ask):
//   ε_u = |w_u| − 1,  s = w_u·w_v,
//   P_u = A (σ_u ŵ_u + τ w_v),  P_v = A (σ_v ŵ_v + τ w_u),
//   σ_u = k_u ε_u (1 + β|ε_u|) + c ε_v + d ε̇_u,  τ = shear s + d_s ṡ,
//   force on corner a = −(g_u[a] P_u + g_v[a] P_v).
// Drag (Bhat et al. 2003, section 3): on the triangle's mean velocity relative to the air, a third a corner.
#pragma once

#include "cloth/kernel/lane_material.h"

namespace selvedge::cloth::kernel {

// What a triangle remembers between steps: friction stresses and the strains of the relaxing branch.
template <class R>
struct MembraneMemory {
  R friction_u{}, friction_v{}, friction_shear{};  // N/m
  R crept_u{}, crept_v{}, crept_shear{};           // strain
};

template <class R>
struct TriangleMotion {
  Vec3<R> w_u, w_v, rate_u, rate_v;
};

template <class R>
inline TriangleMotion<R> motion_of(const Triangle& t, const Vec3<R>* x, const Vec3<R>* v) {
  // Differences to the first corner: gradients sum to zero, and the result is exact under translation.
  const Vec3<R> x1 = x[t.vertex[1]] - x[t.vertex[0]], x2 = x[t.vertex[2]] - x[t.vertex[0]];
  const Vec3<R> v1 = v[t.vertex[1]] - v[t.vertex[0]], v2 = v[t.vertex[2]] - v[t.vertex[0]];
  return {scaled(t.gradient_u[1], x1) + scaled(t.gradient_u[2], x2),
          scaled(t.gradient_v[1], x1) + scaled(t.gradient_v[2], x2),
          scaled(t.gradient_u[1], v1) + scaled(t.gradient_u[2], v2),
          scaled(t.gradient_v[1], v1) + scaled(t.gradient_v[2], v2)};
}

template <class R>
inline Vec3<R> drag_on(const Triangle& t, const Vec3<R>* v, const TriangleMotion<R>& m, const LaneMaterial<R>& p) {
  const Vec3<R> area_normal = cross(m.w_u, m.w_v);
  const R squared = dot(area_normal, area_normal) + 1e-300;
  const Vec3<R> mean = scaled(1.0 / 3.0, v[t.vertex[0]] + v[t.vertex[1]] + v[t.vertex[2]]);
  const Vec3<R> relative = mean - p.air;
  const Vec3<R> normal_part = (dot(relative, area_normal) / squared) * area_normal;
  const Vec3<R> tangent_part = relative - normal_part;
  const R speed2 = dot(normal_part, normal_part);
  const R along_normal = p.drag_normal * square_root(speed2) / (1.0 + p.drag_fade * speed2) + p.drag_linear;
  const Vec3<R> total = along_normal * normal_part + p.drag_tangent * tangent_part;
  return scaled(-t.area / 3.0, total);
}

// corner_force: 3·T entries, overwritten. step_s: of the memory; 0 leaves it as it is.
template <class R>
void membrane_and_drag(const SheetData& sheet, const LaneMaterial<R>& p, const Vec3<R>* x, const Vec3<R>* v,
                       MembraneMemory<R>* memory, double step_s, Vec3<R>* corner_force) {
  const size_t count = sheet.triangles.size();
  for (size_t i = 0; i < count; ++i) {
    const Triangle& t = sheet.triangles[i];
    const TriangleMotion<R> m = motion_of(t, x, v);
    const R length_u = norm(m.w_u), length_v = norm(m.w_v);
    const R inverse_u = 1.0 / length_u, inverse_v = 1.0 / length_v;
    const R strain_u = length_u - 1.0, strain_v = length_v - 1.0;
    const R rate_u = dot(m.w_u, m.rate_u) * inverse_u, rate_v = dot(m.w_v, m.rate_v) * inverse_v;
    const R skew = dot(m.w_u, m.w_v), skew_rate = dot(m.w_u, m.rate_v) + dot(m.w_v, m.rate_u);

    R sigma_u = p.stretch_u * strain_u * (1.0 + p.stiffening * absolute(strain_u)) + p.coupling * strain_v +
                p.stretch_damping * rate_u;
    R sigma_v = p.stretch_v * strain_v * (1.0 + p.stiffening * absolute(strain_v)) + p.coupling * strain_u +
                p.stretch_damping * rate_v;
    R tau = p.shear * skew + p.shear_damping * skew_rate;
    if (p.uses_membrane_memory) {
      MembraneMemory<R>& k = memory[i];
      const R limit = p.stretch_friction + 1e-300;
      k.friction_u += step_s * p.stretch_friction_slope * (rate_u - absolute(rate_u) * k.friction_u / limit);
      k.friction_v += step_s * p.stretch_friction_slope * (rate_v - absolute(rate_v) * k.friction_v / limit);
      k.friction_shear +=
          step_s * p.stretch_friction_slope * (skew_rate - absolute(skew_rate) * k.friction_shear / limit);
      k.crept_u += step_s * p.creep_rate * (strain_u - k.crept_u);
      k.crept_v += step_s * p.creep_rate * (strain_v - k.crept_v);
      k.crept_shear += step_s * p.creep_rate * (skew - k.crept_shear);
      sigma_u += k.friction_u + p.creep * p.stretch_u * (strain_u - k.crept_u);
      sigma_v += k.friction_v + p.creep * p.stretch_v * (strain_v - k.crept_v);
      tau += k.friction_shear + p.creep * p.shear * (skew - k.crept_shear);
    }
    const R along_u = t.area * sigma_u * inverse_u, along_v = t.area * sigma_v * inverse_v;
    const R across = t.area * tau;
    const Vec3<R> pull_u = along_u * m.w_u + across * m.w_v;
    const Vec3<R> pull_v = along_v * m.w_v + across * m.w_u;
    const Vec3<R> drag = drag_on(t, v, m, p);
    for (int a = 0; a < 3; ++a)
      corner_force[3 * i + static_cast<size_t>(a)] =
          drag - scaled(t.gradient_u[a], pull_u) - scaled(t.gradient_v[a], pull_v);
  }
}

}  // namespace selvedge::cloth::kernel
