#include "calib/camera_model.h"

#include <array>

#include <Eigen/Geometry>
#include <ceres/jet.h>
#include <ceres/rotation.h>

namespace selvedge::calib {

namespace {

template <class T>
void project_parameters(const T* camera, const T* shift, const T* point, T* pixel) {
  T c[3];
  ceres::AngleAxisRotatePoint(camera + kRotation, point, c);
  for (int i = 0; i < 3; ++i) c[i] += camera[kTranslation + i];
  if (shift) {
    T moved[3];
    ceres::AngleAxisRotatePoint(shift, c, moved);
    for (int i = 0; i < 3; ++i) c[i] = moved[i] + shift[3 + i];
  }
  const T x = c[0] / c[2], y = c[1] / c[2], r2 = x * x + y * y;
  const T* k = camera + kDistortion;
  const T radial = T(1) + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  pixel[0] = camera[0] * (x * radial + T(2) * k[2] * x * y + k[3] * (r2 + T(2) * x * x)) + camera[2];
  pixel[1] = camera[1] * (y * radial + k[2] * (r2 + T(2) * y * y) + T(2) * k[3] * x * y) + camera[3];
}

Eigen::Matrix3d rotation_matrix(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, rotation_vector / angle).toRotationMatrix();
}

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

Eigen::Vector3d in_camera(const CameraParameters& camera, const Eigen::Vector3d& point) {
  return rotation_matrix(camera.segment<3>(kRotation)) * point + camera.segment<3>(kTranslation);
}

}  // namespace

std::vector<int> free_parameters(DistortionOrder order) {
  std::vector<int> places{0, 1, 2, 3};
  for (int i = 0; i < static_cast<int>(order); ++i) places.push_back(kDistortion + i);
  for (int i = kRotation; i < kParameters; ++i) places.push_back(i);
  return places;
}

Eigen::Vector2d pixel_of(const CameraParameters& camera, const Eigen::Vector3d& point, const PoseShift* shift) {
  Eigen::Vector2d pixel;
  project_parameters(camera.data(), shift ? shift->data() : nullptr, point.data(), pixel.data());
  return pixel;
}

PixelDerivatives derivatives(const CameraParameters& camera, const Eigen::Vector3d& point, const PoseShift* shift) {
  using Jet = ceres::Jet<double, kParameters + 6 + 3>;
  std::array<Jet, kParameters> camera_jet;
  std::array<Jet, 6> shift_jet;
  std::array<Jet, 3> point_jet;
  for (int i = 0; i < kParameters; ++i) camera_jet[i] = Jet(camera[i], i);
  for (int i = 0; i < 6; ++i) shift_jet[i] = Jet(shift ? (*shift)[i] : 0.0, kParameters + i);
  for (int i = 0; i < 3; ++i) point_jet[i] = Jet(point[i], kParameters + 6 + i);
  std::array<Jet, 2> pixel;
  project_parameters(camera_jet.data(), shift_jet.data(), point_jet.data(), pixel.data());
  PixelDerivatives result;
  for (int i = 0; i < 2; ++i) {
    result.pixel[i] = pixel[i].a;
    result.by_camera.row(i) = pixel[i].v.head<kParameters>();
    result.by_shift.row(i) = pixel[i].v.segment<6>(kParameters);
    result.by_point.row(i) = pixel[i].v.tail<3>();
  }
  return result;
}

double depth_of(const CameraParameters& camera, const Eigen::Vector3d& point) { return in_camera(camera, point).z(); }

geometry::Projection to_projection(const CameraParameters& camera, const ImageSize& size) {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  k(0, 0) = camera[0];
  k(1, 1) = camera[1];
  k(0, 2) = camera[2];
  k(1, 2) = camera[3];
  geometry::Projection projection;
  projection.matrix.leftCols<3>() = k * rotation_matrix(camera.segment<3>(kRotation));
  projection.matrix.col(3) = k * camera.segment<3>(kTranslation);
  for (int i = 0; i < 5; ++i) projection.distortion[i] = camera[kDistortion + i];
  projection.width_px = size.width_px;
  projection.height_px = size.height_px;
  return projection;
}

CameraParameters from_projection(const geometry::Projection& projection) {
  const geometry::Decomposition split = geometry::decompose(projection);
  CameraParameters camera;
  camera.segment<4>(0) << split.intrinsics(0, 0), split.intrinsics(1, 1), split.intrinsics(0, 2),
      split.intrinsics(1, 2);
  for (int i = 0; i < 5; ++i) camera[kDistortion + i] = projection.distortion[i];
  camera.segment<3>(kRotation) = rotation_vector(split.rotation_camera_from_world);
  camera.segment<3>(kTranslation) = split.translation_camera_from_world;
  return camera;
}

CameraParameters shifted(const CameraParameters& camera, const PoseShift& shift) {
  CameraParameters result = camera;
  const Eigen::Matrix3d turn = rotation_matrix(shift.head<3>());
  result.segment<3>(kRotation) = rotation_vector(turn * rotation_matrix(camera.segment<3>(kRotation)));
  result.segment<3>(kTranslation) = turn * camera.segment<3>(kTranslation) + shift.tail<3>();
  return result;
}

}  // namespace selvedge::calib
