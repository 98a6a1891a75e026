// Mass and rigidity of each vertex: the fabric's own, its hem's and a local weight's.
#pragma once

#include <cmath>
#include <vector>

#include "cloth/kernel/sheet_data.h"

namespace selvedge::cloth::kernel {

// Share of a vertex that lies within the hem: smooth over half a hem's width so that it does not jump
// with the mesh.
inline double hem_share(double rim_distance, double hem_width) {
  const double x = (hem_width - rim_distance) / (0.5 * hem_width);
  return x <= -1 ? 0.0 : x >= 1 ? 1.0 : 0.5 * (1 + x);
}

// Adds each vertex's part of the local weight: a Gaussian of 12 mm, normalised to the weight on this mesh.
inline void add_local_mass(const SheetData& sheet, const Material& m, std::vector<double>& mass) {
  if (m.local_mass_kg == 0) return;
  std::vector<double> weight(mass.size());
  double sum = 0;
  for (size_t i = 0; i < mass.size(); ++i) {
    const double du = sheet.vertex_u[i] - m.local_u_m, dv = sheet.vertex_v[i] - m.local_v_m;
    weight[i] = sheet.vertex_area[i] * std::exp(-(du * du + dv * dv) / (2 * 0.012 * 0.012));
    sum += weight[i];
  }
  for (size_t i = 0; sum > 0 && i < mass.size(); ++i) mass[i] += m.local_mass_kg * weight[i] / sum;
}

// kg.
inline std::vector<double> vertex_masses(const SheetData& sheet, const Material& m) {
  std::vector<double> mass(static_cast<size_t>(sheet.vertex_count));
  for (size_t v = 0; v < mass.size(); ++v)
    mass[v] = sheet.vertex_area[v] * (m.density + m.hem_density * hem_share(sheet.rim_distance[v], m.hem_width_m));
  add_local_mass(sheet, m, mass);
  return mass;
}

// By which the rigidity at a vertex exceeds the material's.
inline double bend_factor(const SheetData& sheet, const Material& m, size_t vertex) {
  return 1 + m.hem_stiffness * hem_share(sheet.rim_distance[vertex], m.hem_width_m);
}

}  // namespace selvedge::cloth::kernel
