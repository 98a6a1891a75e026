// Least squares over a handful of parameters, for tests whose model takes well below a millisecond: Levenberg–Marquardt
// with forward differences.
#pragma once

#include <functional>

#include <Eigen/Core>

namespace selvedge::material_tests {

// Weighted residuals at x; one that is not finite makes x impossible.
using ResidualFunction = std::function<Eigen::VectorXd(const Eigen::VectorXd& x)>;

struct SmallFit {
  Eigen::VectorXd x, residuals;
  Eigen::MatrixXd jacobian;    // of the residuals at x
  Eigen::MatrixXd covariance;  // (JᵀJ)⁻¹: residuals are in units of their deviation
  double cost = 0;             // Σ residuals²; infinite where no step from the start was possible
};

// difference: of each parameter, for derivatives. low, high: bounds of x.
SmallFit least_squares(const ResidualFunction& residuals, const Eigen::VectorXd& start, double difference,
                       const Eigen::VectorXd& low, const Eigen::VectorXd& high);

}  // namespace selvedge::material_tests
