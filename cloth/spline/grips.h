// What the rig holds of a spline sheet: sums over control points that follow the held path.
//
// A held corner is where the plane through a square of fabric there (least squares over the square) meets the corner: a
// grip of one size, the same on every grid. An edge that is held lies straight; a clamp also keeps its direction.
#pragma once

#include <vector>

#include "cloth/spline/spline_sheet.h"

namespace selvedge::cloth::spline {

struct Weight {
  int point = 0;
  double weight = 0;
};

// Σ weight · control point = left + along (right − left) + below_m · clamp direction.
struct Grip {
  std::vector<Weight> reads;
  double along = 0;  // 0 at the left corner, 1 at the right
  double below_m = 0;
};

std::vector<Grip> grips_of(const SplineSheet& sheet, Hold hold);

Eigen::Vector3d held_position(const Grip& grip, const HeldPath& path, const Eigen::Matrix<double, 3, 2>& corners);

// How masses of a run answer to forces: inverse_u ⊗ inverse_v between two diagonals `scale` (one a control point,
// empty: 1), up to a factor.
struct Inertia {
  Eigen::MatrixXd inverse_u, inverse_v;
  Eigen::VectorXd scale;
};

// What each grip moves when it is to move by 1 and the others stay: R Cᵀ (C R Cᵀ)⁻¹, R the inverse mass, C the rows of
// the grips.
std::vector<std::vector<Weight>> responses(const SplineSheet& sheet, const std::vector<Grip>& grips,
                                           const Inertia& inertia);

}  // namespace selvedge::cloth::spline
