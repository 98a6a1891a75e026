// A camera, or a projector as an inverse camera, as 15 numbers, and how a point becomes a pixel.
//
//   c = R(r) x + t,   n = (c_x, c_y) / c_z,   ρ² = |n|²
//   d = n (1 + k1 ρ² + k2 ρ⁴ + k3 ρ⁶) + (2 p1 n_x n_y + p2 (ρ² + 2 n_x²),  p1 (ρ² + 2 n_y²) + 2 p2 n_x n_y)
//   pixel = (f_x d_x + c_x, f_y d_y + c_y)
//
// Points in m in the frame of the motion capture, pixels with (0,0) at the centre of the top-left one, r a
// rotation vector in rad. Distortion is OpenCV's. A shift (ω, τ) of the device's pose is applied in its
// own frame: c' = R(ω) c + τ.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "calib/poses.h"
#include "geometry/projection.h"

namespace selvedge::calib {

inline constexpr int kParameters = 15;
using CameraParameters = Eigen::Matrix<double, kParameters, 1>;
using PoseShift = Eigen::Matrix<double, 6, 1>;  // ω in rad, τ in m

// Places in CameraParameters.
inline constexpr int kFocal = 0, kPrincipal = 2, kDistortion = 4, kRotation = 9, kTranslation = 12;

// How many of k1 k2 p1 p2 k3 are free, in this order; the rest stay zero.
enum class DistortionOrder { none = 0, k1_k2 = 2, k1_k2_p1_p2 = 4, k1_k2_p1_p2_k3 = 5 };

// Places that are free under an order.
std::vector<int> free_parameters(DistortionOrder order);

// shift: of the device's pose, or none.
Eigen::Vector2d pixel_of(const CameraParameters& camera, const Eigen::Vector3d& point,
                         const PoseShift* shift = nullptr);

struct PixelDerivatives {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, kParameters> by_camera;
  Eigen::Matrix<double, 2, 6> by_shift;
  Eigen::Matrix<double, 2, 3> by_point;
};
// by_shift holds the derivative also where shift is none: at zero shift.
PixelDerivatives derivatives(const CameraParameters& camera, const Eigen::Vector3d& point,
                             const PoseShift* shift = nullptr);

// Distance in front of the device along its axis, m.
double depth_of(const CameraParameters& camera, const Eigen::Vector3d& point);

geometry::Projection to_projection(const CameraParameters& camera, const ImageSize& size);

// Skew is dropped. Throws std::invalid_argument as geometry::decompose.
CameraParameters from_projection(const geometry::Projection& projection);

// The camera after the shift.
CameraParameters shifted(const CameraParameters& camera, const PoseShift& shift);

}  // namespace selvedge::calib
