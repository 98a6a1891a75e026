#include "calib/reprojection_cost.h"

namespace selvedge::calib {

ReprojectionCost::ReprojectionCost(const Sight& sight, bool with_shift) : sight_(sight), fits_device_(true), fits_shift_(with_shift) {
  set_num_residuals(2);
  mutable_parameter_block_sizes()->push_back(kParameters);
  if (with_shift) mutable_parameter_block_sizes()->push_back(6);
}

ReprojectionCost::ReprojectionCost(const Sight& sight, const CameraParameters& device)
    : sight_(sight), device_(device), fits_device_(false), fits_shift_(true) {
  set_num_residuals(2);
  mutable_parameter_block_sizes()->push_back(6);
}

bool ReprojectionCost::Evaluate(const double* const* parameters, double* residuals, double** jacobians) const {
  const CameraParameters device = fits_device_ ? CameraParameters(Eigen::Map<const CameraParameters>(parameters[0])) : device_;
  const int shift_block = fits_device_ ? 1 : 0;
  PoseShift shift = PoseShift::Zero();
  if (fits_shift_) shift = Eigen::Map<const PoseShift>(parameters[shift_block]);
  Eigen::Map<Eigen::Vector2d> residual(residuals);
  if (!jacobians) {
    residual = sight_.whitening * (pixel_of(device, sight_.point, fits_shift_ ? &shift : nullptr) - sight_.pixel);
    return residual.allFinite();
  }
  const PixelDerivatives d = derivatives(device, sight_.point, fits_shift_ ? &shift : nullptr);
  residual = sight_.whitening * (d.pixel - sight_.pixel);
  if (fits_device_ && jacobians[0]) {
    Eigen::Map<Eigen::Matrix<double, 2, kParameters, Eigen::RowMajor>> by_device(jacobians[0]);
    by_device = sight_.whitening * d.by_camera;
  }
  if (fits_shift_ && jacobians[shift_block]) {
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> by_shift(jacobians[shift_block]);
    by_shift = sight_.whitening * d.by_shift;
  }
  return residual.allFinite();
}

}  // namespace selvedge::calib
