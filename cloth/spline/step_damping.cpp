#include "cloth/spline/step_damping.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

namespace selvedge::cloth::spline {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr Index kReach = kStepDampingReach;
constexpr double kTwistBound = 0.8;

// What the band cuts off goes to the nearest three of a row, so that velocities that are constant or linear stay what
// they are.
void cut_to_band(const Basis& basis, MatrixXd& matrix) {
  for (Index i = 0; i < matrix.rows(); ++i) {
    const Index first = std::clamp<Index>(i - 1, 0, matrix.cols() - 3);
    const double here = basis.greville(static_cast<int>(i));
    double sum = 0, moment = 0;
    for (Index j = 0; j < matrix.cols(); ++j) {
      if (std::abs(i - j) <= kReach) continue;
      sum += matrix(i, j);
      moment += matrix(i, j) * (basis.greville(static_cast<int>(j)) - here);
      matrix(i, j) = 0;
    }
    Eigen::Vector3d at;
    for (Index k = 0; k < 3; ++k) at(k) = basis.greville(static_cast<int>(first + k)) - here;
    const double size = at.norm();
    Eigen::Matrix<double, 2, 3> rule;
    rule << Eigen::RowVector3d::Ones(), at.transpose() / size;
    const Eigen::Vector3d change =
        rule.transpose() * (rule * rule.transpose()).inverse() * Eigen::Vector2d(sum, moment / size);
    matrix.row(i).segment<3>(first) += change.transpose();
  }
}

}  // namespace

StepDamping::StepDamping(const Side& side, double share) {
  const MatrixXd one = MatrixXd::Identity(side.bend.rows(), side.bend.cols());
  const MatrixXd damped = (one + share * side.inverse * side.bend).inverse();
  const MatrixXd rate = std::sqrt(share) * side.inverse * side.slope * damped;
  added = damped - one;
  twist = std::sqrt(2) * damped * rate * (one + kTwistBound * kTwistBound * rate * rate).inverse();
  cut_to_band(side.basis, added);
  cut_to_band(side.basis, twist);
}

}  // namespace selvedge::cloth::spline
