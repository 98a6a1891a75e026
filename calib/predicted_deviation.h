// How far the solved parameters may be off where the fabric moves, in px and in mm.
//
//   Σ_pixel(x) = J C Jᵀ,  J = ∂pixel/∂parameters at x;  per axis: √(trace Σ_pixel / 2)
//   triangulated point: x̂ − x = (GᵀG)⁻¹ Gᵀ (J_c δ_c; J_p δ_p), with the part of δ_c and δ_p that comes
//   from the same tracked markers in common; its size: √trace
//
// C: covariance of the parameters. G: both devices' ∂pixel/∂x, one above the other. m, px, mm.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "calib/device_solver.h"

namespace selvedge::calib {

// points_per_axis³ points from corner to corner of the box.
std::vector<Eigen::Vector3d> volume_points(const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                                           int points_per_axis = 5);

// Standard deviation along u and v of the pixel of one point.
Eigen::Vector2d pixel_sd(const CameraParameters& camera,
                         const Eigen::Matrix<double, kParameters, kParameters>& covariance,
                         const Eigen::Vector3d& point);

struct VolumeDeviation {
  double mean_sd_px = 0;  // per axis, mean over the points in view
  Eigen::Vector2d mean_sd_uv_px = Eigen::Vector2d::Zero();
  double largest_sd_px = 0;  // per axis, at the worst point
  double share_in_view = 0;  // of the points
};
// In view: in front of the device and within its image. With none in view the deviations are NaN.
VolumeDeviation volume_deviation(const CameraParameters& camera,
                                 const Eigen::Matrix<double, kParameters, kParameters>& covariance,
                                 const ImageSize& size, const std::vector<Eigen::Vector3d>& points);

bool in_view(const CameraParameters& camera, const ImageSize& size, const Eigen::Vector3d& point);

// Mean over the points that both devices see; NaN where there are none.
double triangulation_sd_mm(const DeviceSolution& camera, const DeviceSolution& projector,
                           const std::vector<Eigen::Vector3d>& points);

}  // namespace selvedge::calib
