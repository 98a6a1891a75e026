// A strip of fabric that hangs over a horizontal edge by its own weight: the planar, inextensible, heavy elastica.
//
//   dθ/ds = κ(M),  dM/ds = −w (L − s) cos θ,  θ(0) = 0,  M(L) = 0,
// θ the slope below the horizontal, s the length from the edge, w weight per area, moments per width. The law of
// bending is that of drape testers (Feng et al. 2022: linear and second-order rigidity)
//   M(κ) = κ (B + B₂ |κ|),
// with B₂ < 0 in every fabric that they measured. Where moment no longer rises with curvature (κ > B / 2|B₂|) the strip
// would fold at the edge: no shape is given. cloth/material.h has softening as B κ (1 + γ κ²); the two agree at the
// curvature 1 / (B / w)^⅓ (bend_stiffening()).
#pragma once

#include <optional>

#include <Eigen/Core>

namespace selvedge::material_tests {

struct BendingLaw {
  double bend = 0;          // B, N·m
  double second_order = 0;  // B₂, N·m²
};

struct HangingStrip {
  Eigen::Matrix2Xd point_m;  // along (horizontal), down; from the edge to the tip, at equal lengths
  double edge_curvature = 0;
};

// weight: N/m². Nothing where the strip would fold at the edge.
std::optional<HangingStrip> hanging_strip(const BendingLaw& law, double weight, double overhang_m, int steps = 120);

// (B / w)^⅓, m.
double bending_length(const BendingLaw& law, double weight);

// As ISO 9073-7's instrument gives it, m: half the overhang whose tip, seen from the edge, lies 41.5° down. Nothing
// where the strip folds before.
std::optional<double> instrument_bending_length(const BendingLaw& law, double weight);

// γ of cloth::Material, m²: as much softer at the curvature 1 / bending length, and there by no more than a half.
double bend_stiffening(const BendingLaw& law, double weight);

}  // namespace selvedge::material_tests
