// The whitened residual of one sighting as a cost of Ceres: W (pixel(θ, x) − z), two numbers.
//
// Parameter blocks: CameraParameters, then the PoseShift where the device stood otherwise. Its derivatives are those of
// calib/camera_model.h, so that one differentiation serves every problem.
#pragma once

#include <ceres/cost_function.h>

#include "calib/camera_model.h"

namespace selvedge::calib {

class Reprojection final : public ceres::CostFunction {
 public:
  // point in m, pixel in px, whitening in 1/px.
  Reprojection(const Eigen::Vector3d& point, const Eigen::Vector2d& pixel, const Eigen::Matrix2d& whitening,
               bool shifted);

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override;

 private:
  const Eigen::Vector3d point_;
  const Eigen::Vector2d pixel_;
  const Eigen::Matrix2d whitening_;
  const bool shifted_;
};

}  // namespace selvedge::calib
