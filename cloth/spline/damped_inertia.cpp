#include "cloth/spline/damped_inertia.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "cloth/step_plan.h"

namespace selvedge::cloth::spline {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNegligible = 1e-4;

// What a row holds beyond the band goes to its nearest three, so that forces that accelerate all alike, or in
// proportion to the place, still do.
void cut_row(const VectorXd& mass, const VectorXd& place, Index i, Index reach, MatrixXd& matrix) {
  const Index first = std::clamp<Index>(i - 1, 0, matrix.cols() - 3);
  double sum = 0, moment = 0;
  for (Index j = 0; j < matrix.cols(); ++j) {
    if (std::abs(i - j) <= reach) continue;
    sum += matrix(i, j) * mass(j);
    moment += matrix(i, j) * mass(j) * (place(j) - place(i));
    matrix(i, j) = 0;
  }
  const Eigen::Vector3d at = place.segment<3>(first).array() - place(i);
  const double size = at.norm();
  Eigen::Matrix<double, 2, 3> rule;
  rule << Eigen::RowVector3d::Ones(), at.transpose() / size;
  const Eigen::Vector3d change =
      rule.transpose() * (rule * rule.transpose()).inverse() * Eigen::Vector2d(sum, moment / size);
  matrix.row(i).segment<3>(first) += change.cwiseQuotient(mass.segment<3>(first)).transpose();
}

}  // namespace

MatrixXd damped_inverse(const Side& side, double damping) {
  if (damping == 0) return side.inverse;
  const Index count = side.inverse.rows();
  const MatrixXd one = MatrixXd::Identity(count, count);
  MatrixXd out = (one + kImplicit * damping * side.inverse * side.bend).partialPivLu().solve(side.inverse);
  Index reach = reach_of(side.inverse);
  for (Index i = 0; i < count; ++i)
    for (Index j = 0; j < count; ++j)
      if (std::abs(out(i, j)) > kNegligible * out(i, i)) reach = std::max(reach, std::abs(i - j));
  VectorXd greville(count);
  for (Index i = 0; i < count; ++i) greville(i) = side.basis.greville(static_cast<int>(i));
  const VectorXd mass = side.mass.rowwise().sum(), place = (side.mass * greville).cwiseQuotient(mass);
  for (Index i = 0; i < count; ++i) cut_row(mass, place, i, reach, out);
  return out;
}

Index reach_of(const MatrixXd& matrix) {
  Index reach = 0;
  for (Index i = 0; i < matrix.rows(); ++i)
    for (Index j = 0; j < matrix.cols(); ++j)
      if (matrix(i, j) != 0) reach = std::max(reach, std::abs(i - j));
  return reach;
}

}  // namespace selvedge::cloth::spline
