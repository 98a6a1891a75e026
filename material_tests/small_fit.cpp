#include "material_tests/small_fit.h"

#include <limits>

#include <Eigen/Cholesky>

#include "estimate/bounded_step.h"

namespace selvedge::material_tests {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

double cost_of(const VectorXd& residuals) {
  return residuals.allFinite() ? residuals.squaredNorm() : std::numeric_limits<double>::infinity();
}

MatrixXd jacobian_at(const ResidualFunction& residuals, const VectorXd& x, const VectorXd& here, double difference,
                     const VectorXd& high) {
  MatrixXd jacobian(here.size(), x.size());
  for (Index k = 0; k < x.size(); ++k) {
    VectorXd beside = x;
    const double step = x(k) + difference > high(k) ? -difference : difference;
    beside(k) += step;
    jacobian.col(k) = (residuals(beside) - here) / step;
  }
  return jacobian.allFinite() ? jacobian : MatrixXd::Zero(here.size(), x.size());
}

}  // namespace

SmallFit least_squares(const ResidualFunction& residuals, const VectorXd& start, double difference, const VectorXd& low,
                       const VectorXd& high) {
  constexpr int kMost = 100;
  constexpr double kEnough = 1e-10;  // decrease of the cost, relative
  SmallFit fit;
  fit.x = start.cwiseMax(low).cwiseMin(high);
  fit.residuals = residuals(fit.x);
  fit.cost = cost_of(fit.residuals);
  double damping = 1e-3;
  for (int iteration = 0; iteration < kMost; ++iteration) {
    fit.jacobian = jacobian_at(residuals, fit.x, fit.residuals, difference, high);
    const MatrixXd normal = fit.jacobian.transpose() * fit.jacobian;
    const VectorXd gradient = fit.jacobian.transpose() * fit.residuals;
    const double before = fit.cost;
    for (; damping < 1e12; damping *= 5) {
      MatrixXd damped = normal;
      damped.diagonal() += damping * normal.diagonal() + VectorXd::Constant(fit.x.size(), 1e-12);
      const VectorXd next = fit.x + estimate::bounded_step(damped, gradient, low - fit.x, high - fit.x);
      VectorXd there = residuals(next);
      const double cost = cost_of(there);
      if (!(cost < fit.cost)) continue;
      fit.x = next;
      fit.residuals = std::move(there);
      fit.cost = cost;
      damping = std::max(1e-9, damping / 10);
      break;
    }
    if (!(before - fit.cost > kEnough * before)) break;
  }
  fit.jacobian = jacobian_at(residuals, fit.x, fit.residuals, difference, high);
  MatrixXd normal = fit.jacobian.transpose() * fit.jacobian;
  normal.diagonal().array() += 1e-12;
  fit.covariance = normal.ldlt().solve(MatrixXd::Identity(fit.x.size(), fit.x.size()));
  return fit;
}

}  // namespace selvedge::material_tests
