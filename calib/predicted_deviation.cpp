#include "calib/predicted_deviation.h"

#include <cmath>
#include <limits>
#include <map>

#include <Eigen/LU>

namespace selvedge::calib {

namespace {

using Covariance = Eigen::Matrix<double, kParameters, kParameters>;

// Covariance between the two devices' parameters: what both owe to the tracker's noise at the same markers.
Covariance common_covariance(const DeviceSolution& a, const DeviceSolution& b) {
  std::map<int, size_t> row_in_b;
  for (size_t i = 0; i < b.seen().size(); ++i)
    if (b.input.used[i]) row_in_b[b.seen()[i].row] = i;
  Covariance common = Covariance::Zero();
  for (size_t i = 0; i < a.seen().size(); ++i) {
    const auto found = row_in_b.find(a.seen()[i].row);
    if (a.input.used[i] && found != row_in_b.end())
      common += a.uncertainty.by_point[i] * b.uncertainty.by_point[found->second].transpose();
  }
  return common * a.input.tracker_noise_m * a.input.tracker_noise_m;
}

}  // namespace

std::vector<Eigen::Vector3d> volume_points(const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                                           int points_per_axis) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < points_per_axis; ++i)
    for (int j = 0; j < points_per_axis; ++j)
      for (int k = 0; k < points_per_axis; ++k)
        points.push_back(low + (high - low).cwiseProduct(Eigen::Vector3d(i, j, k) / (points_per_axis - 1)));
  return points;
}

Eigen::Vector2d pixel_sd(const CameraParameters& camera, const Covariance& covariance, const Eigen::Vector3d& point) {
  const Eigen::Matrix<double, 2, kParameters> jacobian = derivatives(camera, point).by_camera;
  return (jacobian * covariance * jacobian.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
}

bool in_view(const CameraParameters& camera, const ImageSize& size, const Eigen::Vector3d& point) {
  if (depth_of(camera, point) <= 0) return false;
  const Eigen::Vector2d pixel = pixel_of(camera, point);
  return pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < size.width_px - 0.5 && pixel.y() < size.height_px - 0.5;
}

VolumeDeviation volume_deviation(const CameraParameters& camera, const Covariance& covariance, const ImageSize& size,
                                 const std::vector<Eigen::Vector3d>& points) {
  VolumeDeviation result;
  int seen = 0;
  for (const Eigen::Vector3d& point : points) {
    if (!in_view(camera, size, point)) continue;
    const Eigen::Vector2d sd = pixel_sd(camera, covariance, point);
    const double per_axis = std::sqrt(sd.squaredNorm() / 2);
    result.mean_sd_px += per_axis;
    result.mean_sd_uv_px += sd;
    result.largest_sd_px = std::max(result.largest_sd_px, per_axis);
    ++seen;
  }
  const double count = seen > 0 ? seen : std::numeric_limits<double>::quiet_NaN();
  result.mean_sd_px /= count;
  result.mean_sd_uv_px /= count;
  if (seen == 0) result.largest_sd_px = std::numeric_limits<double>::quiet_NaN();
  result.share_in_view = static_cast<double>(seen) / static_cast<double>(points.size());
  return result;
}

double triangulation_sd_mm(const DeviceSolution& camera, const DeviceSolution& projector,
                           const std::vector<Eigen::Vector3d>& points) {
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(2 * kParameters, 2 * kParameters);
  covariance.topLeftCorner<kParameters, kParameters>() = camera.uncertainty.covariance;
  covariance.bottomRightCorner<kParameters, kParameters>() = projector.uncertainty.covariance;
  const Covariance common = common_covariance(camera, projector);
  covariance.topRightCorner<kParameters, kParameters>() = common;
  covariance.bottomLeftCorner<kParameters, kParameters>() = common.transpose();
  double sum = 0;
  int seen = 0;
  for (const Eigen::Vector3d& point : points) {
    if (!in_view(camera.refined.camera, camera.size, point) ||
        !in_view(projector.refined.camera, projector.size, point))
      continue;
    const PixelDerivatives c = derivatives(camera.refined.camera, point);
    const PixelDerivatives p = derivatives(projector.refined.camera, point);
    Eigen::Matrix<double, 4, 3> by_point;
    by_point << c.by_point, p.by_point;
    Eigen::Matrix<double, 4, 2 * kParameters> by_parameters = Eigen::Matrix<double, 4, 2 * kParameters>::Zero();
    by_parameters.topLeftCorner<2, kParameters>() = c.by_camera;
    by_parameters.bottomRightCorner<2, kParameters>() = p.by_camera;
    const Eigen::Matrix<double, 3, 2 * kParameters> moved =
        (by_point.transpose() * by_point).inverse() * by_point.transpose() * by_parameters;
    sum += std::sqrt(std::max((moved * covariance * moved.transpose()).trace(), 0.0));
    ++seen;
  }
  return seen > 0 ? 1000 * sum / seen : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace selvedge::calib
