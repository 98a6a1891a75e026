// Materials of all lanes, unpacked to what the force loops read.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "cloth/kernel/force_field.h"
#include "cloth/kernel/pack.h"
#include "cloth/kernel/vertex_parts.h"

namespace selvedge::cloth::kernel {

// Dahl's law of dry friction with stiffness k and limit m_max, over one step: ṁ = k (q̇ − |q̇| m / m_max). Brought from
// flat: m = m_max (1 − exp(−k |q| / m_max)), along q.
template <class R>
inline void slide(R& moment, R q, R rate, R slope, R limit, double step_s) {
  const R most = limit + 1e-300;
  if (step_s == kBroughtFromFlat) {
    const R size = limit * (1.0 - exponential(-slope * absolute(q) / most));
    moment = q < 0.0 ? -size : size;
  } else {
    moment += step_s * slope * (rate - absolute(rate) * moment / most);
  }
}

template <class R>
struct LaneMaterial {
  using VertexVector = VertexVectorOf<R>;
  R stretch_u, stretch_v, coupling, shear, stretch_damping, shear_damping, stiffening, softening;
  R bend_uu, bend_uv, bend_vv, bend_damping, bend_stiffening;
  R rest_u, rest_v;
  R drag_normal, drag_tangent, drag_fade, drag_linear, added_mass;
  R bend_friction, bend_friction_slope, stretch_friction, stretch_friction_slope;
  R creep, creep_rate;
  VertexVector gravity;
  Vec3<R> air;
  bool uses_normals = false;  // vertex normals are needed
  bool uses_bend_friction = false;
  bool uses_membrane_memory = false;
  bool uses_stretch_extras = false;  // stiffening or coupling
  bool uses_general_bending = false;
  bool uses_added_mass = false;
  bool measures_arcs = false;  // the sheet does, and no clamp holds it
  bool uses_bend_stiffening = false;
  std::vector<R> mass;          // N, kg
  std::vector<R> inverse_mass;  // N, 1/kg
  std::vector<R> bend_factor;   // N, 1 away from hems
};

template <class R>
void fill_lane(LaneMaterial<R>& out, const SheetData& sheet, const Material& m, const Surroundings& s, int i) {
  const double ku = m.stretch * std::exp(m.stretch_anisotropy), kv = m.stretch * std::exp(-m.stretch_anisotropy);
  set_lane(out.stretch_u, i, ku);
  set_lane(out.stretch_v, i, kv);
  set_lane(out.coupling, i, m.coupling * std::sqrt(ku * kv));
  set_lane(out.shear, i, m.shear);
  set_lane(out.stretch_damping, i, m.stretch_damping);
  set_lane(out.shear_damping, i, m.shear_damping);
  set_lane(out.stiffening, i, std::max(0.0, m.stretch_stiffening));
  set_lane(out.softening, i, std::max(0.0, -m.stretch_stiffening));
  set_lane(out.bend_uu, i, m.bend * std::exp(m.bend_anisotropy));
  set_lane(out.bend_uv, i, m.bend);
  set_lane(out.bend_vv, i, m.bend * std::exp(-m.bend_anisotropy));
  set_lane(out.bend_damping, i, m.bend_damping);
  set_lane(out.bend_stiffening, i, m.bend_stiffening);
  set_lane(out.rest_u, i, m.rest_curvature_u);
  set_lane(out.rest_v, i, m.rest_curvature_v);
  set_lane(out.drag_normal, i, m.drag_normal);
  set_lane(out.drag_tangent, i, m.drag_tangent);
  set_lane(out.drag_fade, i, m.drag_fade);
  set_lane(out.drag_linear, i, m.drag_linear);
  set_lane(out.added_mass, i, m.added_mass);
  set_lane(out.bend_friction, i, m.bend_friction);
  set_lane(out.bend_friction_slope, i, m.bend_friction / m.bend_friction_curvature);
  set_lane(out.stretch_friction, i, m.stretch_friction);
  set_lane(out.stretch_friction_slope, i, m.stretch_friction / m.stretch_friction_strain);
  set_lane(out.creep, i, m.creep);
  set_lane(out.creep_rate, i, 1 / m.creep_time_s);
  set_run(out.gravity, i, s.gravity[0], s.gravity[1], s.gravity[2]);
  set_lane(out.air.x, i, s.air_velocity[0]);
  set_lane(out.air.y, i, s.air_velocity[1]);
  set_lane(out.air.z, i, s.air_velocity[2]);
  out.uses_bend_friction |= m.bend_friction != 0;
  out.uses_membrane_memory |= m.stretch_friction != 0 || m.creep != 0;
  out.uses_stretch_extras |= m.stretch_stiffening != 0 || m.coupling != 0;
  out.uses_general_bending |= !bends_uniformly(m);
  out.uses_added_mass |= m.added_mass != 0;
  out.uses_bend_stiffening |= m.bend_stiffening != 0;
  out.uses_normals |= m.bend_friction != 0 || m.rest_curvature_u != 0 || m.rest_curvature_v != 0 || m.added_mass != 0;

  const std::vector<double> mass = vertex_masses(sheet, m);
  for (size_t v = 0; v < mass.size(); ++v) {
    set_lane(out.bend_factor[v], i, bend_factor(sheet, m, v));
    set_lane(out.mass[v], i, mass[v]);
    set_lane(out.inverse_mass[v], i, 1 / mass[v]);
  }
}

// materials, surroundings: one a lane; lanes beyond `count` repeat the last.
template <class R>
LaneMaterial<R> unpack(const SheetData& sheet, const Material* materials, const Surroundings* surroundings, int count,
                       const std::vector<HeldVertex>& held) {
  LaneMaterial<R> out{};
  const auto n = static_cast<size_t>(sheet.vertex_count);
  out.mass.assign(n, R{});
  out.inverse_mass.assign(n, R{});
  out.bend_factor.assign(n, R{});
  for (int i = 0; i < lanes_of<R>; ++i) {
    const int from = i < count ? i : count - 1;
    fill_lane(out, sheet, materials[from], surroundings[from], i);
  }
  out.measures_arcs = !sheet.arcs.empty();
  for (const HeldVertex& h : held) {
    if (h.bend_share == 1) continue;
    // The rows of a clamp lie flat, whatever the stencils beside it say of their curvature.
    out.measures_arcs = false;
    out.uses_general_bending = true;
    out.bend_factor[static_cast<size_t>(h.vertex)] *= broadcast<R>(h.bend_share);
  }
  return out;
}

}  // namespace selvedge::cloth::kernel
