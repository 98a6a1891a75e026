// A pinhole camera, or a projector seen as an inverse camera: pixel = dehomogenise(P · [x; 1]).
//
// P is 3×4, row major, in pixels; pixel (0,0) is the centre of the top-left pixel. It maps points of the
// motion-capture frame (m, z up) to undistorted pixels. Distortion is OpenCV's k1 k2 p1 p2 k3, applied to
// normalised image coordinates; it needs P split into K [R | t], which `intrinsics` of `decompose` gives.
#pragma once

#include <array>

#include <Eigen/Core>

namespace selvedge::geometry {

struct Projection {
  Eigen::Matrix<double, 3, 4> matrix = Eigen::Matrix<double, 3, 4>::Zero();  // px from m
  std::array<double, 5> distortion{};                                        // k1 k2 p1 p2 k3, dimensionless
  int width_px = 0;
  int height_px = 0;
};

// A device at `position` (m) whose optical axis meets `target`, with `up` upwards in its image; no distortion.
Projection looking_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target, const Eigen::Vector2d& focal_px,
                      const Eigen::Vector2d& principal_px, int width_px, int height_px,
                      const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ());
// The same with square pixels and the axis in the middle of the image.
Projection looking_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target, double focal_px, int width_px,
                      int height_px);

// P = K [R | t] up to scale; K upper triangular with positive diagonal and K(2,2) = 1, R a rotation.
struct Decomposition {
  Eigen::Matrix3d intrinsics;  // px
  Eigen::Matrix3d rotation_camera_from_world;
  Eigen::Vector3d translation_camera_from_world;  // m
};

// Throws std::invalid_argument where the left 3×3 block is singular (a camera at infinity).
Decomposition decompose(const Projection& projection);

// Optical centre in the motion-capture frame, m: the null vector of P.
Eigen::Vector3d centre(const Projection& projection);

// Pixel of a point (m), with distortion where there is any. NaN where the point lies in the focal plane.
Eigen::Vector2d project(const Projection& projection, const Eigen::Vector3d& point);

// Signed distance of a point in front of the camera along its optical axis, m.
double depth(const Projection& projection, const Eigen::Vector3d& point);

// Undistorted pixel of a distorted one (fixed-point iteration, as OpenCV's undistortPoints).
Eigen::Vector2d undistort(const Projection& projection, const Eigen::Vector2d& pixel);

// Unit direction in the motion-capture frame of the ray through a (distorted) pixel.
Eigen::Vector3d ray(const Projection& projection, const Eigen::Vector2d& pixel);

// Singular values of P after its rows are scaled to norm one: largest first. Rank below 3 shows as
// third / first below 1e-9.
Eigen::Vector3d singular_values(const Eigen::Matrix<double, 3, 4>& matrix);

}  // namespace selvedge::geometry
