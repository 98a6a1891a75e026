// Stiffness and damping of a whole sheet as one sparse matrix.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "cloth/material.h"
#include "cloth/sheet.h"

namespace selvedge::cloth {

using StiffnessMatrix = Eigen::SparseMatrix<double>;

// Stiffness and damping times their factors, in one matrix: stiffness K + damping D.
struct Shares {
  double stiffness, damping;
};

// 3N × 3N, at the shape x (3×N, m), with the masses (N, kg) on its diagonal where with_mass. Of stretch, shear and
// bending; tension stiffens sideways, compression is left out, so that the matrix is positive semidefinite.
StiffnessMatrix stiffness_matrix(const Sheet& sheet, const Material& material, const Eigen::VectorXd& mass,
                                 const Eigen::Matrix3Xd& x, const Shares& share, bool with_mass);

// Replaces the rows and columns of held numbers by those of the identity.
void hold_still(const std::vector<char>& is_held, StiffnessMatrix& matrix);

}  // namespace selvedge::cloth
