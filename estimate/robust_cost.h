// Cauchy's robust cost, its weights and scale, over whitened residuals.
#pragma once

#include <Eigen/Core>

namespace selvedge::estimate {

inline constexpr double kCauchy = 3;  // c, in robust standard deviations of what is fitted

// ½ c² Σ ln(1 + (r/c)²) over rows, and its weights.
double cauchy_cost(const Eigen::VectorXd& r, double c);
Eigen::VectorXd cauchy_weights(const Eigen::VectorXd& r, double c);

// 1.4826 × median |r| of the rows that are not zero (zero: not seen); at least 1e-3, 1 where nothing is seen.
double robust_scale(const Eigen::VectorXd& r);

}  // namespace selvedge::estimate
