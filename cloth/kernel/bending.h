// Bending forces.
//
// At each vertex the second derivatives x_uu, x_uv, x_vv (1/m) come from a least-squares quadratic over its
// neighbours, exact for quadratics on any mesh; the energy per area is
//   ½ B_uu |x_uu|² + B_uv |x_uv|² + ½ B_vv |x_vv|²,
// which for an isometric (unstretched) sheet is ½ B κ², whichever way it bends. It is quadratic in the
// positions, invariant to rotation, and depends on no edge directions. Where the rigidity is one number for
// the whole sheet the force is −B Q x with a matrix Q of the mesh alone. Rest curvature, friction and
// stiffening work on the parts along the vertex normal n.
#pragma once

#include "cloth/kernel/lane_material.h"

namespace selvedge::cloth::kernel {

// Friction moments of a vertex, N.
template <class R>
struct BendMemory {
  R uu{}, uv{}, vv{};
};

template <class V>
struct SecondDerivatives {
  V uu, uv, vv;
};

// force = −Q y for the rows row … row + Count − 1, which are alike.
template <int Count, class V>
inline void alike_rows(const BendMatrix& matrix, int row, const V* y, V* force) {
  const int* index = matrix.index.data();
  const double* value = matrix.value.data();
  V even[Count], odd[Count];  // two sums, so that one addition need not wait for the other
  for (int r = 0; r < Count; ++r) even[r] = odd[r] = V{};
  int k = matrix.start[static_cast<size_t>(row)];
  const int end = matrix.start[static_cast<size_t>(row) + 1];
  for (; k + 1 < end; k += 2) {
    const V *here = y + index[k], *there = y + index[k + 1];
    for (int r = 0; r < Count; ++r) {
      even[r] = add_scaled(value[k], here[r], even[r]);
      odd[r] = add_scaled(value[k + 1], there[r], odd[r]);
    }
  }
  if (k < end)
    for (int r = 0; r < Count; ++r) even[r] = add_scaled(value[k], y[index[k] + r], even[r]);
  for (int r = 0; r < Count; ++r) force[row + r] = V{} - (even[r] + odd[r]);
}

// force = −Q y. Rows that are alike are taken together, as many as their sums find room in registers.
template <class V>
void uniform_bending(const SheetData& sheet, const V* y, V* force) {
#ifdef __AVX512F__
  constexpr int kTogether = sizeof(V) == sizeof(Quad) ? 8 : 4;  // of 32 registers
#else
  constexpr int kTogether = sizeof(V) == sizeof(Quad) ? 4 : 2;  // of 16
#endif
  for (const BendMatrix::Alike& rows : sheet.bend_matrix.alike) {
    int row = rows.first;
    const int end = rows.first + rows.count;
    for (; row + kTogether <= end; row += kTogether) alike_rows<kTogether>(sheet.bend_matrix, row, y, force);
    for (; row < end; ++row) alike_rows<1>(sheet.bend_matrix, row, y, force);
  }
}

template <class V>
inline SecondDerivatives<V> second_derivatives(const BendStencils& b, size_t vertex, const V* y) {
  SecondDerivatives<V> d{};
  for (int k = b.start[vertex]; k < b.start[vertex + 1]; ++k) {
    const auto at = static_cast<size_t>(k);
    const V& value = y[b.index[at]];
    d.uu = add_scaled(b.uu[at], value, d.uu);
    d.uv = add_scaled(b.uv[at], value, d.uv);
    d.vv = add_scaled(b.vv[at], value, d.vv);
  }
  return d;
}

// Adds to force the pull of the moments (N per width) at a vertex.
template <class V>
inline void add_moments(const SheetData& sheet, size_t vertex, const SecondDerivatives<V>& moment, V* force) {
  const BendStencils& b = sheet.bend;
  const double area = sheet.vertex_area[vertex];
  const V uu = scaled(area, moment.uu), uv = scaled(2 * area, moment.uv), vv = scaled(area, moment.vv);
  for (int k = b.start[vertex]; k < b.start[vertex + 1]; ++k) {
    const auto j = static_cast<size_t>(k);
    force[b.index[j]] -= add_scaled(b.uu[j], uu, add_scaled(b.uv[j], uv, scaled(b.vv[j], vv)));
  }
}

// Moments at all vertices where bending is more than one rigidity. all: their second derivatives. normal: N unit
// normals, read only where p.uses_normals.
template <class V>
void general_moments(const SheetData& sheet, const LaneMaterial<ScalarOf<V>>& p, const SecondDerivatives<V>* all,
                     const V* v, const V* normal, BendMemory<ScalarOf<V>>* memory, double step_s,
                     SecondDerivatives<V>* moments) {
  using R = ScalarOf<V>;
  for (size_t i = 0; i < static_cast<size_t>(sheet.vertex_count); ++i) {
    const SecondDerivatives<V>& shape = all[i];
    const SecondDerivatives<V> rate = second_derivatives(sheet.bend, i, v);
    R stiff = p.bend_factor[i];
    if (p.uses_bend_stiffening) {
      const R squared = dot(shape.uu, shape.uu) + 2.0 * dot(shape.uv, shape.uv) + dot(shape.vv, shape.vv);
      stiff *= larger(1.0 + p.bend_stiffening * squared, broadcast<R>(0.05));
    }
    SecondDerivatives<V>& moment = moments[i];
    moment = {(p.bend_uu * stiff) * shape.uu + p.bend_damping * rate.uu,
              (p.bend_uv * stiff) * shape.uv + p.bend_damping * rate.uv,
              (p.bend_vv * stiff) * shape.vv + p.bend_damping * rate.vv};
    if (p.uses_normals) {
      const V& n = normal[i];
      moment.uu -= (p.bend_uu * p.rest_u) * n;
      moment.vv -= (p.bend_vv * p.rest_v) * n;
      if (p.uses_bend_friction) {
        BendMemory<R>& k = memory[i];
        const R slope = p.bend_friction_slope, limit = p.bend_friction;
        slide(k.uu, dot(shape.uu, n), dot(rate.uu, n), slope, limit, step_s);
        slide(k.uv, dot(shape.uv, n), dot(rate.uv, n), slope, limit, step_s);
        slide(k.vv, dot(shape.vv, n), dot(rate.vv, n), slope, limit, step_s);
        moment.uu += k.uu * n;
        moment.uv += k.uv * n;
        moment.vv += k.vv * n;
      }
    }
  }
}

}  // namespace selvedge::cloth::kernel
