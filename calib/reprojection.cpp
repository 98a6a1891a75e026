#include "calib/reprojection.h"

namespace selvedge::calib {

Reprojection::Reprojection(const Eigen::Vector3d& point, const Eigen::Vector2d& pixel, const Eigen::Matrix2d& whitening,
                           bool shifted)
    : point_(point), pixel_(pixel), whitening_(whitening), shifted_(shifted) {
  set_num_residuals(2);
  mutable_parameter_block_sizes()->push_back(kParameters);
  if (shifted) mutable_parameter_block_sizes()->push_back(PoseShift::SizeAtCompileTime);
}

bool Reprojection::Evaluate(const double* const* parameters, double* residuals, double** jacobians) const {
  const CameraParameters camera(parameters[0]);
  const PoseShift shift = shifted_ ? PoseShift(parameters[1]) : PoseShift(PoseShift::Zero());
  const PoseShift* const moved = shifted_ ? &shift : nullptr;
  Eigen::Map<Eigen::Vector2d> residual(residuals);
  if (!jacobians) {
    residual = whitening_ * (pixel_of(camera, point_, moved) - pixel_);
    return true;
  }
  const PixelDerivatives at = derivatives(camera, point_, moved);
  residual = whitening_ * (at.pixel - pixel_);
  if (jacobians[0]) {
    Eigen::Map<Eigen::Matrix<double, 2, kParameters, Eigen::RowMajor>> by_camera(jacobians[0]);
    by_camera = whitening_ * at.by_camera;
  }
  if (shifted_ && jacobians[1]) {
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> by_shift(jacobians[1]);
    by_shift = whitening_ * at.by_shift;
  }
  return true;
}

}  // namespace selvedge::calib
