// The factorised stiffness of a spline sheet, in blocks along its band (kernel/banded.h).
#pragma once

#include <vector>

#include <Eigen/Core>

#include "cloth/spline/aligned.h"
#include "cloth/spline/kernel/tables.h"
#include "cloth/spline/tangent.h"

namespace selvedge::cloth::spline {

class BandedSolver {
 public:
  explicit BandedSolver(const SplineSheet& sheet);

  // Of tangent + added (one number a control point) on the diagonal; rows and columns of held numbers (3 i + axis) are
  // those of the identity. False: it is not positive definite.
  bool factorise(const Tangent& tangent, const Eigen::VectorXd& added, const std::vector<char>& is_held);

  // Each column as it would be alone.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;

 private:
  double& entry(int i, int j);  // i ≥ j, of places
  kernel::BandedMatrix matrix() const;

  int columns_, rows_, blocks_, reach_;
  std::vector<int> place_;  // of a control point; the band lies across the shorter side
  mutable Aligned<double> block_, inverse_;
};

}  // namespace selvedge::cloth::spline
