// What a fabric is made of, per area and per width, so that nothing depends on the mesh.
//
// Base model (Bhat et al. 2003, after Baraff & Witkin 1998): energy densities per flat area
//   ½ stretch ((|w_u|−1)² + (|w_v|−1)²) + ½ shear (w_u·w_v)² + ½ bend (|x_uu|² + 2|x_uv|² + |x_vv|²),
// where w_u, w_v are the columns of ∂x/∂(u,v). For a sheet that bends without stretching the last term is
// ½ bend κ², the flexural rigidity per width. Damping acts on the rate of the same measures. Air drag per area:
//   −( drag_normal |v_N| v_N / (1 + drag_fade |v_N|²) + drag_tangent v_T ), v relative to the air.
#pragma once

namespace selvedge::cloth {

struct Material {
  double density = 0.16;          // kg/m², flat
  double stretch = 110;           // N/m
  double shear = 55;              // N/m
  double bend = 5.5e-5;           // N·m
  double stretch_damping = 0.04;  // N·s/m
  double shear_damping = 0.04;    // N·s/m
  double bend_damping = 5e-7;     // N·m·s
  double drag_normal = 1.05;      // kg/m³
  double drag_tangent = 0.05;     // kg/(m²·s)
  double drag_fade = 0.2;         // s²/m²
};

}  // namespace selvedge::cloth
