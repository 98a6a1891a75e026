// Bending forces.
//
// At each vertex the second derivatives x_uu, x_uv, x_vv (1/m) come from a least-squares quadratic over its
// neighbours, exact for quadratics on any mesh; the energy per area is
//   ½ B_uu |x_uu|² + B_uv |x_uv|² + ½ B_vv |x_vv|²,
// which for an isometric (unstretched) sheet is ½ B κ², whichever way it bends. It is quadratic in the
// positions, invariant to rotation, and depends on no edge directions. Rest curvature, friction and
// stiffening work on the parts along the vertex normal n.
#pragma once

#include "cloth/kernel/lane_material.h"

namespace selvedge::cloth::kernel {

// Friction moments of a vertex, N.
template <class R>
struct BendMemory {
  R uu{}, uv{}, vv{};
};

template <class R>
struct SecondDerivatives {
  Vec3<R> uu, uv, vv;
};

template <class R>
inline SecondDerivatives<R> second_derivatives(const BendStencils& b, int vertex, const Vec3<R>* y) {
  SecondDerivatives<R> d{};
  for (int k = b.start[static_cast<size_t>(vertex)]; k < b.start[static_cast<size_t>(vertex) + 1]; ++k) {
    const auto at = static_cast<size_t>(k);
    const Vec3<R>& value = y[b.index[at]];
    d.uu += scaled(b.uu[at], value);
    d.uv += scaled(b.uv[at], value);
    d.vv += scaled(b.vv[at], value);
  }
  return d;
}

// Friction moment along each second derivative: Dahl's law ṁ = k (κ̇ − |κ̇| m / m_max).
template <class R>
inline void slide(R& moment, R rate, const LaneMaterial<R>& p, double step_s) {
  const R limit = p.bend_friction + 1e-300;
  moment += step_s * p.bend_friction_slope * (rate - absolute(rate) * moment / limit);
}

// Adds to force. normal: N unit normals, read only where p.uses_normals.
template <class R>
void bending(const SheetData& sheet, const LaneMaterial<R>& p, const Vec3<R>* x, const Vec3<R>* v,
             const Vec3<R>* normal, BendMemory<R>* memory, double step_s, Vec3<R>* force) {
  const BendStencils& b = sheet.bend;
  for (int i = 0; i < sheet.vertex_count; ++i) {
    const auto at = static_cast<size_t>(i);
    const SecondDerivatives<R> shape = second_derivatives(b, i, x), rate = second_derivatives(b, i, v);
    R stiff = p.bend_factor[at];
    if (p.uses_bend_stiffening) {
      const R squared = dot(shape.uu, shape.uu) + 2.0 * dot(shape.uv, shape.uv) + dot(shape.vv, shape.vv);
      stiff *= larger(1.0 + p.bend_stiffening * squared, broadcast<R>(0.05));
    }
    Vec3<R> m_uu = (p.bend_uu * stiff) * shape.uu + p.bend_damping * rate.uu;
    Vec3<R> m_uv = (p.bend_uv * stiff) * shape.uv + p.bend_damping * rate.uv;
    Vec3<R> m_vv = (p.bend_vv * stiff) * shape.vv + p.bend_damping * rate.vv;
    if (p.uses_normals) {
      const Vec3<R>& n = normal[at];
      m_uu -= (p.bend_uu * p.rest_u) * n;
      m_vv -= (p.bend_vv * p.rest_v) * n;
      if (p.uses_bend_friction) {
        BendMemory<R>& k = memory[at];
        slide(k.uu, dot(rate.uu, n), p, step_s);
        slide(k.uv, dot(rate.uv, n), p, step_s);
        slide(k.vv, dot(rate.vv, n), p, step_s);
        m_uu += k.uu * n;
        m_uv += k.uv * n;
        m_vv += k.vv * n;
      }
    }
    const double area = sheet.vertex_area[at];
    m_uu = scaled(area, m_uu);
    m_uv = scaled(2 * area, m_uv);
    m_vv = scaled(area, m_vv);
    for (int k = b.start[at]; k < b.start[at + 1]; ++k) {
      const auto j = static_cast<size_t>(k);
      force[b.index[j]] -= scaled(b.uu[j], m_uu) + scaled(b.uv[j], m_uv) + scaled(b.vv[j], m_vv);
    }
  }
}

}  // namespace selvedge::cloth::kernel
