// Accelerations of all vertices, from the forces of the fabric and its surroundings.
//
// V: vertex vector, Vec3 of lanes for lanes of runs or Quad for a single run.
#pragma once

#include <algorithm>
#include <vector>

#include "cloth/kernel/arc_length.h"
#include "cloth/kernel/membrane_and_drag.h"

namespace selvedge::cloth::kernel {

// The same materials, as the loops over triangles and those over vertices read them.
template <class V>
struct Materials {
  LaneMaterial<TrianglesOf<V>> triangle;
  LaneMaterial<ScalarOf<V>> vertex;
};

template <class V>
Materials<V> unpack_materials(const SheetData& sheet, const Material* materials, const Surroundings* surroundings,
                              int count, const std::vector<HeldVertex>& held) {
  return {unpack<TrianglesOf<V>>(sheet, materials, surroundings, count, held),
          unpack<ScalarOf<V>>(sheet, materials, surroundings, count, held)};
}

// Working memory of one run; positions in m, velocities in m/s, accelerations in m/s².
template <class V>
struct Workspace {
  explicit Workspace(const SheetData& sheet)
      : packed(sheet), x(count(sheet)), v(count(sheet)), acceleration(count(sheet)), normal(count(sheet)),
        scratch(count(sheet)), membrane(sheet.triangles.size()), bend(count(sheet)), shape(count(sheet)),
        moment(count(sheet)), products(sheet.arcs.empty() ? 0 : count(sheet)), pulls(products.size()) {}

  void keep_frames() { frames.resize(membrane.size()); }

  static size_t count(const SheetData& sheet) { return static_cast<size_t>(sheet.vertex_count); }

  PackedTriangles packed;
  std::vector<V> x, v, acceleration, normal, scratch;
  std::vector<MembraneMemory<TrianglesOf<V>>> membrane;
  std::vector<typename KeptFrame<V>::Type>
      frames;  // of the last accelerations; empty where no stages of damping follow
  std::vector<BendMemory<ScalarOf<V>>> bend;
  std::vector<SecondDerivatives<V>> shape, moment;
  std::vector<SixOf<V>> products, pulls;  // of arcs; empty where the sheet measures none
};

// Unit normals at the vertices: triangles' area normals summed.
template <class V>
void vertex_normals(const SheetData& sheet, const V* x, V* normal) {
  const auto count = static_cast<size_t>(sheet.vertex_count);
  for (size_t i = 0; i < count; ++i) normal[i] = V{};
  for (const Triangle& t : sheet.triangles) {
    const V n = cross(x[t.vertex[1]] - x[t.vertex[0]], x[t.vertex[2]] - x[t.vertex[0]]);
    for (const int corner : t.vertex) normal[corner] += n;
  }
  for (size_t i = 0; i < count; ++i) normal[i] = (1.0 / (norm(normal[i]) + 1e-300)) * normal[i];
}

// Air carried along the normal makes the mass (m 1 + m_a n nᵀ): Sherman–Morrison gives its inverse.
// Weight is not carried: buoyancy of still air is in the drag-free pressure field.
template <class V>
void carry_air(const SheetData& sheet, const LaneMaterial<ScalarOf<V>>& p, const V* normal, V* acceleration) {
  for (size_t i = 0; i < static_cast<size_t>(sheet.vertex_count); ++i) {
    const ScalarOf<V> carried = p.added_mass * sheet.vertex_area[i];
    const V& n = normal[i];
    acceleration[i] -= (carried / (p.mass[i] + carried) * dot(acceleration[i], n)) * n;
  }
}

// Fills w.acceleration. step_s advances the memories of friction and creep.
template <class V>
void accelerations(const SheetData& sheet, const Materials<V>& m, Workspace<V>& w, double step_s) {
  const auto& p = m.vertex;
  const size_t n = w.x.size();
  V* a = w.acceleration.data();
  if (p.uses_normals) vertex_normals(sheet, w.x.data(), w.normal.data());
  const bool takes_moments = p.measures_arcs || p.uses_general_bending;
  if (takes_moments)
    for (size_t i = 0; i < n; ++i) w.shape[i] = second_derivatives(sheet.bend, i, w.x.data());
  Arcs<V> arcs;
  if (p.measures_arcs) {
    measure_arcs(n, w.shape.data(), w.products.data());
    std::fill(w.pulls.begin(), w.pulls.end(), SixOf<V>{});
    arcs = {w.products.data(), w.pulls.data()};
  }
  if (p.uses_general_bending) {
    std::fill(a, a + n, V{});
    general_moments(sheet, p, w.shape.data(), w.v.data(), w.normal.data(), w.bend.data(), step_s, w.moment.data());
  } else if (p.measures_arcs) {
    for (size_t i = 0; i < n; ++i) {
      w.scratch[i] = p.bend_damping * w.v[i];
      w.moment[i] = {p.bend_uv * w.shape[i].uu, p.bend_uv * w.shape[i].uv, p.bend_uv * w.shape[i].vv};
    }
    uniform_bending(sheet, w.scratch.data(), a);
  } else {
    for (size_t i = 0; i < n; ++i) w.scratch[i] = add_scaled(p.bend_uv, w.x[i], p.bend_damping * w.v[i]);
    uniform_bending(sheet, w.scratch.data(), a);
  }
  membrane_and_drag(sheet, w.packed, m.triangle, w.x.data(), w.v.data(), w.membrane.data(), step_s,
                    w.frames.empty() ? nullptr : w.frames.data(), arcs, a);
  if (p.measures_arcs) add_arc_moments(sheet, w.shape.data(), w.pulls.data(), w.moment.data());
  for (size_t i = 0; takes_moments && i < n; ++i) add_moments(sheet, i, w.moment[i], a);
  for (size_t i = 0; i < n; ++i) a[i] = add_scaled(p.inverse_mass[i], a[i], p.gravity);
  if (p.uses_added_mass) carry_air(sheet, p, w.normal.data(), a);
}

// Accelerations by the material damping of the velocities v alone, at w.x and what the last accelerations kept of it.
template <class V>
void damping_accelerations(const SheetData& sheet, const Materials<V>& m, Workspace<V>& w, const std::vector<V>& v,
                           std::vector<V>& out) {
  const auto& p = m.vertex;
  for (size_t i = 0; i < out.size(); ++i) w.scratch[i] = p.bend_damping * v[i];
  uniform_bending(sheet, w.scratch.data(), out.data());
  membrane_damping(sheet, w.packed, m.triangle, w.frames.data(), w.x.data(), v.data(), out.data());
  for (size_t i = 0; i < out.size(); ++i) out[i] = p.inverse_mass[i] * out[i];
  if (p.uses_added_mass) carry_air(sheet, p, w.normal.data(), out.data());
}

}  // namespace selvedge::cloth::kernel
