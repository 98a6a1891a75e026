// A projection split once, for many points: (pixel x, pixel y, w) with the lens distortion applied.
// w: third homogeneous coordinate, positive in front where the left block's determinant is positive.
// Source of the distortion: OpenCV's radial-tangential model, as in geometry/projection.h.
#pragma once

#include <algorithm>

#include <Eigen/LU>

#include "geometry/projection.h"

namespace selvedge::render {

class FastProjection {
 public:
  explicit FastProjection(const geometry::Projection& projection)
      : matrix_(projection.matrix), k_(projection.distortion) {
    distorted_ = std::any_of(k_.begin(), k_.end(), [](double k) { return k != 0; });
    if (distorted_) {
      intrinsics_ = geometry::decompose(projection).intrinsics;
      inverse_ = intrinsics_.inverse();
    }
  }

  Eigen::Vector3d operator()(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d h = matrix_.leftCols<3>() * point + matrix_.col(3);
    Eigen::Vector3d pixel(h.x() / h.z(), h.y() / h.z(), 1);
    if (distorted_) {
      const Eigen::Vector3d n = inverse_ * pixel;
      const double x = n.x(), y = n.y(), r2 = x * x + y * y;
      const double radial = 1 + r2 * (k_[0] + r2 * (k_[1] + r2 * k_[4]));
      pixel = intrinsics_ * Eigen::Vector3d(x * radial + 2 * k_[2] * x * y + k_[3] * (r2 + 2 * x * x),
                                            y * radial + k_[2] * (r2 + 2 * y * y) + 2 * k_[3] * x * y, 1);
    }
    pixel.z() = h.z();
    return pixel;
  }

 private:
  Eigen::Matrix<double, 3, 4> matrix_;
  std::array<double, 5> k_;
  bool distorted_ = false;
  Eigen::Matrix3d intrinsics_ = Eigen::Matrix3d::Identity(), inverse_ = Eigen::Matrix3d::Identity();
};

}  // namespace selvedge::render
