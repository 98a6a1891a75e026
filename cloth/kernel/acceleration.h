// Accelerations of all vertices of all lanes, from the forces of the fabric and its surroundings.
#pragma once

#include <vector>

#include "cloth/kernel/bending.h"
#include "cloth/kernel/membrane_and_drag.h"

namespace selvedge::cloth::kernel {

// Working memory of one run; positions in m, velocities in m/s, forces in N.
template <class R>
struct Workspace {
  explicit Workspace(const SheetData& sheet)
      : x(count(sheet)), v(count(sheet)), force(count(sheet)), normal(count(sheet)),
        corner_force(3 * sheet.triangles.size()), membrane(sheet.triangles.size()), bend(count(sheet)) {}

  static size_t count(const SheetData& sheet) { return static_cast<size_t>(sheet.vertex_count); }

  std::vector<Vec3<R>> x, v, force, normal, corner_force;
  std::vector<MembraneMemory<R>> membrane;
  std::vector<BendMemory<R>> bend;
};

// Unit normals at the vertices: triangles' area normals summed.
template <class R>
void vertex_normals(const SheetData& sheet, const Vec3<R>* x, Vec3<R>* normal) {
  for (int i = 0; i < sheet.vertex_count; ++i) normal[i] = Vec3<R>{};
  for (const Triangle& t : sheet.triangles) {
    const Vec3<R> n = cross(x[t.vertex[1]] - x[t.vertex[0]], x[t.vertex[2]] - x[t.vertex[0]]);
    for (const int corner : t.vertex) normal[corner] += n;
  }
  for (int i = 0; i < sheet.vertex_count; ++i) {
    const R length = norm(normal[i]) + 1e-300;
    normal[i] = (1.0 / length) * normal[i];
  }
}

// Air carried along the normal makes the mass (m 1 + m_a n nᵀ): Sherman–Morrison gives its inverse.
template <class R>
inline void carry_air(const SheetData& sheet, const LaneMaterial<R>& p, const Vec3<R>* normal, Vec3<R>* acceleration) {
  for (int i = 0; i < sheet.vertex_count; ++i) {
    const auto at = static_cast<size_t>(i);
    const R carried = p.added_mass * sheet.vertex_area[at];
    const Vec3<R>& n = normal[at];
    // Weight is not carried: buoyancy of still air is in the drag-free pressure field.
    acceleration[i] -= (carried / (p.mass[at] + carried) * dot(acceleration[i], n)) * n;
  }
}

// Fills w.force with accelerations, m/s². step_s advances the memories of friction and creep.
template <class R>
void accelerations(const SheetData& sheet, const LaneMaterial<R>& p, Workspace<R>& w, double step_s) {
  if (p.uses_normals) vertex_normals(sheet, w.x.data(), w.normal.data());
  membrane_and_drag(sheet, p, w.x.data(), w.v.data(), w.membrane.data(), step_s, w.corner_force.data());
  for (size_t i = 0; i < w.force.size(); ++i) {
    Vec3<R> sum{};
    for (int k = sheet.incidence.start[i]; k < sheet.incidence.start[i + 1]; ++k)
      sum += w.corner_force[static_cast<size_t>(sheet.incidence.corner[static_cast<size_t>(k)])];
    w.force[i] = sum;
  }
  bending(sheet, p, w.x.data(), w.v.data(), w.normal.data(), w.bend.data(), step_s, w.force.data());
  for (size_t i = 0; i < w.force.size(); ++i) w.force[i] = p.inverse_mass[i] * w.force[i] + p.gravity;
  if (p.uses_added_mass) carry_air(sheet, p, w.normal.data(), w.force.data());
}

}  // namespace selvedge::cloth::kernel
