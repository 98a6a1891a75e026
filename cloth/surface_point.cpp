#include "cloth/surface_point.h"

#include <map>

namespace selvedge::cloth {

SurfacePoint surface_point(const Sheet& sheet, const Eigen::Vector2d& uv) {
  const geometry::MaterialPoint flat = geometry::locate(sheet.mesh, uv);
  const auto corner = [&](size_t k) { return sheet.mesh.rest_uv[static_cast<size_t>(flat.vertices[k])]; };
  Eigen::Vector2d here = Eigen::Vector2d::Zero();
  for (size_t k = 0; k < 3; ++k) here += flat.weights(static_cast<Eigen::Index>(k)) * corner(k);
  // Σ w f(corner) = f + ½ Σ w d·H·d with d from the point to the corner.
  double uu = 0, uv_twice = 0, vv = 0;
  std::map<int, double> sum;
  for (size_t k = 0; k < 3; ++k) {
    const double w = flat.weights(static_cast<Eigen::Index>(k));
    const Eigen::Vector2d d = corner(k) - here;
    uu += 0.5 * w * d.x() * d.x();
    uv_twice += w * d.x() * d.y();
    vv += 0.5 * w * d.y() * d.y();
    sum[flat.vertices[k]] += w;
  }
  const kernel::BendStencils& b = sheet.data.bend;
  for (size_t k = 0; k < 3; ++k) {
    const auto vertex = static_cast<size_t>(flat.vertices[k]);
    for (int j = b.start[vertex]; j < b.start[vertex + 1]; ++j) {
      const auto at = static_cast<size_t>(j);
      sum[b.index[at]] -=
          flat.weights(static_cast<Eigen::Index>(k)) * (uu * b.uu[at] + uv_twice * b.uv[at] + vv * b.vv[at]);
    }
  }
  SurfacePoint out;
  for (const auto& [vertex, weight] : sum)
    if (weight != 0) {
      out.vertices.push_back(vertex);
      out.weights.push_back(weight);
    }
  return out;
}

Eigen::Vector3d position_of(const SurfacePoint& point, const Eigen::Matrix3Xd& position) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (size_t k = 0; k < point.vertices.size(); ++k) sum += point.weights[k] * position.col(point.vertices[k]);
  return sum;
}

}  // namespace selvedge::cloth
