// Energy of a hanging disc by the law of cloth/material.h, its slope and its curvature.
//
// Stretch, shear, coupling and stiffening as there. Of bending: with κ_uu, κ_uv, κ_vv the second derivatives, s =
// |κ_uu|² + 2|κ_uv|² + |κ_vv|², density ½ bend (e^b |κ_uu|² + 2|κ_uv|² + e^−b |κ_vv|² + G(s) − s), dG/ds = max(0.05, 1
// + γ s). J; no motion, friction, creep, hem or rest curvature.
#pragma once

#include "cloth/material.h"
#include "material_tests/bending_length.h"
#include "material_tests/disc_sheet.h"
#include "material_tests/ring_matrix.h"

namespace selvedge::material_tests {

class DiscEnergy {
 public:
  DiscEnergy(const DiscSheet& sheet, const cloth::Material& material) : sheet_(sheet), m_(material) {}

  // Of the control points, 3×N; J.
  double value(const Eigen::Matrix3Xd& control) const;

  // Free numbers alone: three for each control point that is not held, [spoke][ring][axis].
  Eigen::Index free() const { return 3 * Eigen::Index(sheet_.rings() - kHeldRings) * sheet_.spokes(); }
  Eigen::Index place(Eigen::Index point) const;  // of a control point's first number; negative where it is held
  Eigen::VectorXd masses() const;                // kg, of each free number

  // The energy; slope and curvature of the free numbers are overwritten. convex: parts of the curvature that could
  // make it indefinite are left out.
  double derivatives(const Eigen::Matrix3Xd& control, bool convex, Eigen::VectorXd& slope, RingMatrix& curvature) const;
  RingMatrix empty_curvature() const;

 private:
  const DiscSheet& sheet_;
  const cloth::Material m_;
};

}  // namespace selvedge::material_tests
