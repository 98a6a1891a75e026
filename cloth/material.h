// What a fabric is made of, per area and per width, so that nothing depends on the mesh.
//
// Base model (Bhat et al. 2003, after Baraff & Witkin 1998): energy densities per flat area
//   ½ stretch (ε_u² + ε_v²) + ½ shear (w_u·w_v)² + ½ bend (|x_uu|² + 2|x_uv|² + |x_vv|²),
// where w_u, w_v are the columns of ∂x/∂(u,v) and ε_u = |w_u| − 1. For a sheet that bends without
// stretching the last term is ½ bend κ², the flexural rigidity per width. Damping acts on the rates of the
// same measures. Air drag per area, v relative to the air:
//   −( drag_normal |v_N| v_N / (1 + drag_fade |v_N|²) + drag_tangent v_T + drag_linear v_N ).
#pragma once

namespace selvedge::cloth {

struct Material {
  double density = 0.16;          // kg/m², flat
  double stretch = 120;           // N/m
  double shear = 50;              // N/m
  double bend = 4e-5;             // N·m
  double stretch_damping = 0.03;  // N·s/m
  double shear_damping = 0.03;    // N·s/m
  double bend_damping = 3e-7;     // N·m·s
  double drag_normal = 0.8;       // kg/m³
  double drag_tangent = 0.05;     // kg/(m²·s)
  double drag_fade = 0.2;         // s²/m²
  double drag_linear = 0;         // kg/(m²·s), the linear drag law on v_N of models before 2003

  // What the base model lacks; each is neutral at the value given here.
  double stretch_anisotropy = 0;           // a: k_u = stretch e^a, k_v = stretch e^−a
  double bend_anisotropy = 0;              // b: rigidity about v is bend e^b (x_uu), about u bend e^−b (x_vv)
  double coupling = 0;                     // ν: + ν √(k_u k_v) ε_u ε_v, Poisson-like
  double stretch_stiffening = 0;           // β (stiffening.h)
  double bend_stiffening = 0;              // γ, m²: moment = bend κ (1 + γ |κ|²), bounded below at 0.05
  double rest_curvature_u = 0;             // 1/m, curvature of the stress-free sheet along u (sign: along the normal)
  double rest_curvature_v = 0;             // 1/m, along v
  double bend_friction = 0;                // N, moment per width at which bending friction saturates
  double bend_friction_curvature = 4;      // 1/m, change of curvature over which it saturates
  double stretch_friction = 0;             // N/m, stress at which stretch and shear friction saturate
  double stretch_friction_strain = 0.005;  // strain over which it saturates
  double creep = 0;                        // share of membrane stiffness added as a relaxing (Maxwell) branch
  double creep_time_s = 1;                 // its relaxation time
  double added_mass = 0;                   // kg/m², air carried along the normal
  double hem_stiffness = 0;                // h: bend within hem_width of the rim is multiplied by 1 + h
  double hem_density = 0;                  // kg/m² added within hem_width of the rim
  double hem_width_m = 0.012;
  double local_mass_kg = 0;  // a small weight at (local_u_m, local_v_m)
  double local_u_m = 0.15;
  double local_v_m = 0.25;
};

// True where bending is a matrix of the mesh times one rigidity B for the whole sheet.
inline bool bends_uniformly(const Material& m) {
  return m.bend_anisotropy == 0 && m.bend_stiffening == 0 && m.rest_curvature_u == 0 && m.rest_curvature_v == 0 &&
         m.bend_friction == 0 && m.hem_stiffness == 0;
}

}  // namespace selvedge::cloth
