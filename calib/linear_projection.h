// A first 3×4 projection from points and pixels: the direct linear transform, and RANSAC around it.
//
// Hartley's normalisation: points and pixels moved to their mean and scaled to mean distances √3 and √2.
// Each pair gives two rows of A p = 0; p is the eigenvector of AᵀA with the least eigenvalue. Where the
// points do not determine P (all on one plane, say) the two least singular values of A are alike.
// Source: R. Hartley, A. Zisserman, Multiple View Geometry, 2nd ed., 7.1 and 4.7.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace selvedge::calib {

struct LinearProjection {
  Eigen::Matrix<double, 3, 4> matrix = Eigen::Matrix<double, 3, 4>::Zero();
  double singular_ratio = 1;  // least / second least singular value: near 1 where P is not determined
  std::vector<char> inlier;   // one a pair
  double inlier_share = 0;
};

// All pairs, at least six. Distortion is ignored.
LinearProjection direct_linear_transform(const std::vector<Eigen::Vector3d>& points,
                                         const std::vector<Eigen::Vector2d>& pixels);

struct RansacOptions {
  double threshold_px = 12;  // wide: the linear model leaves out the distortion
  int sample = 8;            // pairs in a sample
  int most_samples = 2000;
  double confidence = 0.9999;
  unsigned seed = 1;
};

LinearProjection ransac_projection(const std::vector<Eigen::Vector3d>& points,
                                   const std::vector<Eigen::Vector2d>& pixels, const RansacOptions& options);

}  // namespace selvedge::calib
