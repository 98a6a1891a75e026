#include "model/seen_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

namespace selvedge::model {

namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kPointsAcross = 12;
constexpr double kFurthest_m = 0.05;  // a ray that goes by a fold tells nothing of it

// What one ray tells: a point of the fabric, and how much further than the seen one the sheet lies.
struct OnRay {
  Vector2d uv;
  double off_m;
};

std::vector<OnRay> seen_in(const cloth::spline::View& view, const observe::StripeTrack& stripes,
                           const Matrix3Xd& control, const observe::SensorModel& sensor) {
  const geometry::TriangleMesh& mesh = view.mesh();
  std::vector<OnRay> out;
  for (const observe::SurfaceHit& hit : surface_hits(stripes, stripes.frames.front(), mesh, view.of(control), sensor)) {
    if (hit.triangle < 0 || std::abs(hit.off_m) > kFurthest_m) continue;
    Vector2d uv = Vector2d::Zero();
    for (size_t c = 0; c < 3; ++c)
      uv += hit.weights(static_cast<Index>(c)) *
            mesh.rest_uv[static_cast<size_t>(mesh.triangles[static_cast<size_t>(hit.triangle)][c])];
    out.push_back({uv, hit.off_m});
  }
  return out;
}

// A plane through what was seen around a point (Gaussian weights), at the point; NaN where too little was.
double plane_at(const std::vector<OnRay>& seen, const Vector2d& uv, double radius_m) {
  constexpr double kLeastWeight = 2;
  Eigen::Matrix3d normal = Vector3d(0, 0.1, 0.1).asDiagonal();
  Vector3d right = Vector3d::Zero();
  for (const OnRay& s : seen) {
    const Vector2d from = (s.uv - uv) / radius_m;
    if (from.squaredNorm() > 9) continue;
    const double weight = std::exp(-0.5 * from.squaredNorm());
    const Vector3d row(1, from.x(), from.y());
    normal += weight * row * row.transpose();
    right += weight * s.off_m * row;
  }
  if (normal(0, 0) < kLeastWeight) return std::numeric_limits<double>::quiet_NaN();
  return normal.ldlt().solve(right)(0);
}

Vector3d normal_at(const cloth::spline::SplineSheet& sheet, const Matrix3Xd& control, const Vector2d& uv) {
  constexpr double kStep_m = 2e-3;
  const auto along = [&](const Vector2d& step) -> Vector3d {
    return position_of(surface_point(sheet, uv + step), control) -
           position_of(surface_point(sheet, uv - step), control);
  };
  return along({kStep_m, 0}).cross(along({0, kStep_m})).normalized();
}

}  // namespace

std::shared_ptr<const cloth::GuideTrack> seen_surface(const cloth::spline::SplineSheet& sheet,
                                                      const cloth::spline::View& view,
                                                      const observe::StripeTrack& stripes, const Matrix3Xd& control,
                                                      const observe::SensorModel& sensor) {
  const double height = sheet.swatch.height_m, step = sheet.swatch.width_m / kPointsAcross;
  const int down = std::max(1, static_cast<int>(std::lround(height / step)));
  const std::vector<OnRay> seen = seen_in(view, stripes, control, sensor);
  const Vector3d centre = geometry::centre(stripes.camera);
  auto out = std::make_shared<cloth::GuideTrack>();
  out->time_s = {stripes.frames.front().time_s};
  out->position.resize(3, kPointsAcross * down);
  out->normal.resize(3, kPointsAcross * down);
  for (int r = 0; r < down; ++r)
    for (int c = 0; c < kPointsAcross; ++c) {
      const Vector2d uv((c + 0.5) * step, (r + 0.5) * height / down);
      const auto at = static_cast<Index>(out->points.size());
      out->points.push_back(surface_point(sheet, uv));
      const Vector3d x = position_of(out->points.back(), control);
      out->position.col(at) = x - plane_at(seen, uv, step) * (x - centre).normalized();
      out->normal.col(at) = normal_at(sheet, control, uv);
    }
  return out;
}

}  // namespace selvedge::model
