#include "cloth/start_shapes.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

namespace selvedge::cloth {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

// r² ln r.
double rise(double r2) { return r2 > 0 ? 0.5 * r2 * std::log(r2) : 0; }

Eigen::RowVector3d affine(const Vector2d& p, double scale_m) { return {1, p.x() / scale_m, p.y() / scale_m}; }

}  // namespace

ShapeOf hung(const HeldPath& path, double start_s, const Vector3d& gravity_m_s2, double width_m, double side) {
  const Eigen::Matrix<double, 3, 2> corners = path.at(start_s);
  const Vector3d along = corners.col(1) - corners.col(0);
  const Vector3d down = gravity_m_s2.normalized();
  const Vector3d out = down.cross(along).normalized() * (side < 0 ? -1 : 1);
  const double slack = std::max(0.0, width_m / along.norm() - 1);
  const double bulge =
      path.hold == Hold::corners ? std::max(2 * along.norm() / M_PI * std::sqrt(slack), 0.01 * width_m) : 0.0;
  return [=, left = Vector3d(corners.col(0))](const Vector2d& uv) -> Vector3d {
    const double u = uv.x() / width_m;
    // A trace of v keeps a flat start from balancing on a ridge of its energy.
    const double swell = bulge * std::sin(M_PI * u) + (side < 0 ? 1.3e-4 : 1e-4) * std::sin(3 * u + uv.y() * 20);
    return left + u * along + uv.y() * down + swell * out;
  };
}

ShapeOf thin_plate(const std::vector<Vector2d>& uv, const Eigen::Matrix3Xd& shift, double scale_m) {
  const auto n = static_cast<Index>(uv.size());
  const auto between = [scale_m](const Vector2d& a, const Vector2d& b) {
    return rise((a - b).squaredNorm() / (scale_m * scale_m));  // scaled, the system is well conditioned
  };
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 3, n + 3);
  for (Index i = 0; i < n; ++i) {
    const Vector2d& p = uv[static_cast<size_t>(i)];
    for (Index j = 0; j < n; ++j) system(i, j) = between(p, uv[static_cast<size_t>(j)]);
    system(i, i) += 1e-4;
    system.block<1, 3>(i, n) = affine(p, scale_m);
    system.block<3, 1>(n, i) = affine(p, scale_m).transpose();
  }
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(n + 3, 3);
  right.topRows(n) = shift.transpose();
  const Eigen::MatrixX3d weights = system.partialPivLu().solve(right);
  return [=](const Vector2d& p) -> Vector3d {
    Eigen::RowVector3d sum = affine(p, scale_m) * weights.bottomRows<3>();
    for (Index i = 0; i < n; ++i) sum += between(p, uv[static_cast<size_t>(i)]) * weights.row(i);
    return sum.transpose();
  };
}

}  // namespace selvedge::cloth
