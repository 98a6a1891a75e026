// Energy of a spline sheet in double precision: what forces are the slope of.
//
// For materials whose forces have an energy: no friction, creep or rest curvature, and where bending softens or
// stiffens, alike both ways.
#pragma once

#include <Eigen/SparseCore>

#include "cloth/energy.h"
#include "cloth/spline/spline_sheet.h"

namespace selvedge::cloth::spline {

// control, velocity: 3 × N of control points, m and m/s. The kinetic part is of the mass that the steps work with.
Energy energy_of(const SplineSheet& sheet, const Material& material, const Eigen::Vector3d& gravity_m_s2,
                 const Eigen::Matrix3Xd& control, const Eigen::Matrix3Xd& velocity);

// Bending energy of rigidity 1 along u, along v and in twist, as matrices over the control points.
struct BendMatrices {
  Eigen::SparseMatrix<double> uu, uv, vv;
};
BendMatrices bend_matrices(const SplineSheet& sheet);

}  // namespace selvedge::cloth::spline
