// What a sighting costs a Ceres problem: its whitened reprojection error, derivatives from camera_model.h.
#pragma once

#include <ceres/cost_function.h>

#include "calib/camera_model.h"

namespace selvedge::calib {

// residual = whitening · (projection − pixel), two numbers. Parameter blocks: the device's kParameters unless it is held
// fixed, then the 6 of a shift where one is fitted.
class ReprojectionCost final : public ceres::CostFunction {
 public:
  struct Sight {
    Eigen::Vector3d point;      // m
    Eigen::Vector2d pixel;      // px
    Eigen::Matrix2d whitening;  // 1/px
  };

  ReprojectionCost(const Sight& sight, bool with_shift);
  // The device held fixed.
  ReprojectionCost(const Sight& sight, const CameraParameters& device);

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Sight sight_;
  CameraParameters device_ = CameraParameters::Zero();
  bool fits_device_, fits_shift_;
};

}  // namespace selvedge::calib
