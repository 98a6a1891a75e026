#include "estimate/bounded_step.h"

#include <random>

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

namespace selvedge::estimate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

double value_of(const MatrixXd& normal, const VectorXd& gradient, const VectorXd& step) {
  return gradient.dot(step) + 0.5 * step.dot(normal * step);
}

// Two coordinates that make up for each other, the first on its bound: cut off there, the solution of both goes uphill.
TEST(BoundedStep, MakesUpForNoMoveThatIsNotTaken) {
  MatrixXd normal(2, 2);
  normal << 1, 0.9, 0.9, 1;
  const VectorXd gradient = Eigen::Vector2d(-1, 0.05), low = Eigen::Vector2d(-5, -5), high = Eigen::Vector2d(0, 5);
  const VectorXd cut_off = VectorXd(-normal.ldlt().solve(gradient)).cwiseMax(low).cwiseMin(high);
  EXPECT_GT(value_of(normal, gradient, cut_off), 0);
  const VectorXd step = bounded_step(normal, gradient, low, high);
  EXPECT_NEAR(step(0), 0, 1e-12);
  EXPECT_NEAR(step(1), -0.05, 1e-12);
}

TEST(BoundedStep, IsGaussNewtonsWhereBoundsAreFarAndStaysWithinThemWhereTheyAreNear) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal_number;
  for (int round = 0; round < 50; ++round) {
    const MatrixXd j = MatrixXd::NullaryExpr(20, 6, [&] { return normal_number(generator); });
    const VectorXd r = VectorXd::NullaryExpr(20, [&] { return normal_number(generator); });
    const MatrixXd normal = j.transpose() * j;
    const VectorXd gradient = j.transpose() * r, far = VectorXd::Constant(6, 1e3), near = VectorXd::Constant(6, 0.05);
    EXPECT_LT((bounded_step(normal, gradient, -far, far) + normal.ldlt().solve(gradient)).norm(), 1e-9);
    const VectorXd step = bounded_step(normal, gradient, -near, near);
    EXPECT_LE(step.cwiseAbs().maxCoeff(), 0.05 + 1e-12);
    EXPECT_LT(value_of(normal, gradient, step), 0);
  }
}

}  // namespace
}  // namespace selvedge::estimate
