// What is compared of two outlines from above, whichever way they are turned.
#pragma once

#include <complex>
#include <vector>

#include <Eigen/Core>

namespace selvedge::material_tests {

inline constexpr int kHarmonics = 24;
inline constexpr double kFoldDepth_m = 2e-3;  // a fold is counted from this height above the valleys beside it

struct OutlineMeasures {
  double drape_coefficient = 0;  // (A − A_support) / (A_disc − A_support)
  int folds = 0;
  Eigen::VectorXd radius_m;                       // outermost, at even angles from the x axis, anticlockwise
  std::vector<std::complex<double>> harmonics_m;  // r(θ) = Re Σ c_k e^{ikθ}, k = 0 … kHarmonics; c_0 the mean
  double fold_amplitude_m() const;                // √(½ Σ |c_k|²) from k = 3: root mean square of what folds do
};

// disc_m, support_m: diameters.
OutlineMeasures measure_outline(const Eigen::Matrix2Xd& outline, double disc_m, double support_m);

// Angle by which `other` is to be turned so that its radii are nearest to these, and the root mean square that is left.
struct Turned {
  double angle_rad = 0, left_m = 0;
};
Turned turn_onto(const OutlineMeasures& measured, const OutlineMeasures& other);

}  // namespace selvedge::material_tests
