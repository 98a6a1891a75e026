#include "cloth/start_shape.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace selvedge::cloth {

using Eigen::Vector2d;
using Eigen::Vector3d;

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

}  // namespace selvedge::cloth
