#include "geometry/projection.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace selvedge::geometry {

namespace {

bool is_distorted(const Projection& projection) {
  for (const double k : projection.distortion)
    if (k != 0) return true;
  return false;
}

// OpenCV's radial-tangential model on normalised coordinates.
Eigen::Vector2d distorted(const std::array<double, 5>& d, const Eigen::Vector2d& p) {
  const double x = p.x(), y = p.y(), r2 = x * x + y * y;
  const double radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  return {x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x),
          y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y};
}

}  // namespace

Decomposition decompose(const Projection& projection) {
  const Eigen::Matrix3d left = projection.matrix.leftCols<3>();
  const double determinant = left.determinant();
  if (std::abs(determinant) < 1e-12 * std::pow(left.norm(), 3))
    throw std::invalid_argument("decompose: the left 3x3 block of the projection is singular");

  // RQ by QR of the row-reversed transpose.
  Eigen::Matrix3d flip;
  flip << 0, 0, 1, 0, 1, 0, 1, 0, 0;
  const double sign = determinant > 0 ? 1 : -1;
  const Eigen::Matrix3d reversed = (flip * (sign * left)).transpose();
  const Eigen::HouseholderQR<Eigen::Matrix3d> qr(reversed);
  const Eigen::Matrix3d q = qr.householderQ();
  const Eigen::Matrix3d r = qr.matrixQR().triangularView<Eigen::Upper>();
  Eigen::Matrix3d k = flip * r.transpose() * flip;
  Eigen::Matrix3d rotation = flip * q.transpose();
  for (int i = 0; i < 3; ++i)
    if (k(i, i) < 0) {
      k.col(i) *= -1;
      rotation.row(i) *= -1;
    }
  Decomposition result;
  result.translation_camera_from_world = k.inverse() * (sign * projection.matrix.col(3));
  result.rotation_camera_from_world = rotation;
  result.intrinsics = k / k(2, 2);
  return result;
}

Eigen::Vector3d centre(const Projection& projection) {
  return -projection.matrix.leftCols<3>().inverse() * projection.matrix.col(3);
}

Eigen::Vector2d project(const Projection& projection, const Eigen::Vector3d& point) {
  const Eigen::Vector3d h = projection.matrix * point.homogeneous();
  if (h.z() == 0) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  const Eigen::Vector2d pixel = h.hnormalized();
  if (!is_distorted(projection)) return pixel;
  const Eigen::Matrix3d k = decompose(projection).intrinsics;
  const Eigen::Vector3d normalised = k.inverse() * pixel.homogeneous();
  return (k * distorted(projection.distortion, normalised.hnormalized()).homogeneous()).hnormalized();
}

double depth(const Projection& projection, const Eigen::Vector3d& point) {
  const Eigen::Matrix3d left = projection.matrix.leftCols<3>();
  const double sign = left.determinant() > 0 ? 1 : -1;
  return sign * (projection.matrix.row(2) * point.homogeneous())(0) / left.row(2).norm();
}

Eigen::Vector2d undistort(const Projection& projection, const Eigen::Vector2d& pixel) {
  if (!is_distorted(projection)) return pixel;
  const Eigen::Matrix3d k = decompose(projection).intrinsics;
  const Eigen::Vector2d target = (k.inverse() * pixel.homogeneous()).hnormalized();
  Eigen::Vector2d guess = target;
  for (int i = 0; i < 30; ++i) guess += target - distorted(projection.distortion, guess);
  return (k * guess.homogeneous()).hnormalized();
}

Eigen::Vector3d ray(const Projection& projection, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d straight = undistort(projection, pixel);
  const Eigen::Matrix3d left = projection.matrix.leftCols<3>();
  const double sign = left.determinant() > 0 ? 1 : -1;
  return (sign * left.inverse() * straight.homogeneous()).normalized();
}

Projection looking_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target, const Eigen::Vector2d& focal_px,
                      const Eigen::Vector2d& principal_px, int width_px, int height_px, const Eigen::Vector3d& up) {
  const Eigen::Vector3d forward = (target - position).normalized(), right = forward.cross(up).normalized();
  Eigen::Matrix3d rotation, intrinsics;
  rotation << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  intrinsics << focal_px.x(), 0, principal_px.x(), 0, focal_px.y(), principal_px.y(), 0, 0, 1;
  Projection projection;
  projection.matrix.leftCols<3>() = intrinsics * rotation;
  projection.matrix.col(3) = -intrinsics * rotation * position;
  projection.width_px = width_px;
  projection.height_px = height_px;
  return projection;
}

Projection looking_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target, double focal_px, int width_px,
                      int height_px) {
  return looking_at(position, target, {focal_px, focal_px}, {width_px / 2.0, height_px / 2.0}, width_px, height_px);
}

Eigen::Vector3d singular_values(const Eigen::Matrix<double, 3, 4>& matrix) {
  Eigen::Matrix<double, 3, 4> scaled = matrix;
  for (int i = 0; i < 3; ++i)
    if (scaled.row(i).norm() > 0) scaled.row(i).normalize();
  return Eigen::JacobiSVD<Eigen::Matrix<double, 3, 4>>(scaled).singularValues();
}

}  // namespace selvedge::geometry
