// How a piece out of a longer trial moves where it begins.
#pragma once

#include <Eigen/Core>

namespace selvedge::model {

struct Underway {
  Eigen::Matrix3Xd position, velocity;  // of the control points, m and m/s; no columns: it begins at rest
  Eigen::Matrix<double, 3, 2> grips;    // where it is held, left and right, m

  // The same moved to where other grips are, so that nothing is jerked, m.
  Eigen::Matrix3Xd position_held_at(const Eigen::Matrix<double, 3, 2>& others) const {
    const Eigen::Vector3d across = grips.col(1) - grips.col(0);
    const Eigen::Matrix<double, 3, 2> by = others - grips;
    const Eigen::RowVectorXd share = across.transpose() * (position.colwise() - grips.col(0)) / across.squaredNorm();
    return (position + (by.col(1) - by.col(0)) * share).colwise() + by.col(0);
  }
};

}  // namespace selvedge::model
