// The solver of damped least squares, on problems whose least is known.
#include "estimate/descent.h"

#include <limits>

#include <gtest/gtest.h>

namespace selvedge::estimate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFar = std::numeric_limits<double>::infinity();

// Residuals of a bent valley (Rosenbrock's, less steep), the least at (1, 1).
VectorXd valley(const VectorXd& x) { return VectorXd{{2 * (x(1) - x(0) * x(0)), 1 - x(0)}}; }

MatrixXd slope_at(const VectorXd& x) { return MatrixXd{{-4 * x(0), 2}, {-1, 0}}; }

DescentProblem free_problem() {
  DescentProblem p;
  p.lower = VectorXd::Constant(2, -kFar);
  p.upper = VectorXd::Constant(2, kFar);
  p.longest = VectorXd::Constant(2, kFar);
  p.prior_centre = p.prior_weight = VectorXd::Zero(2);
  p.cauchy = 1e3;  // nearly squares
  return p;
}

DescentPoint begin_at(const DescentProblem& problem, const VectorXd& x) {
  DescentPoint at{x, valley(x), slope_at(x), 0};
  at.cost = cost_at(problem, x, at.residual);
  return at;
}

MatrixXd evaluate(const std::vector<MatrixXd>& tries) {
  std::vector<VectorXd> columns;
  for (const MatrixXd& some : tries)
    for (const auto& x : some.colwise()) columns.push_back(valley(x));
  MatrixXd out(2, static_cast<Eigen::Index>(columns.size()));
  for (size_t k = 0; k < columns.size(); ++k) out.col(static_cast<Eigen::Index>(k)) = columns[k];
  return out;
}

const std::vector<double> kDampings = {1e-3, 0.3, 30};

// Rounds with derivatives afresh, or as they are learned.
DescentPoint gone(const DescentProblem& problem, int rounds, Learning learning, bool afresh) {
  std::vector<DescentPoint> at = {begin_at(problem, VectorXd{{-1.2, 1}})};
  for (int round = 0; round < rounds; ++round) {
    if (afresh) at[0].jacobian = slope_at(at[0].x);
    step({problem}, at, kDampings, evaluate, learning);
  }
  return at[0];
}

TEST(Descent, ComesToTheLeastOfAValley) {
  EXPECT_LT((gone(free_problem(), 30, Learning::from_the_step_taken, true).x - VectorXd::Ones(2)).norm(), 1e-5);
}

TEST(Descent, DerivativesThatAreLearnedFromEveryTryLeadThereToo) {
  EXPECT_LT((gone(free_problem(), 60, Learning::from_every_try, false).x - VectorXd::Ones(2)).norm(), 1e-3);
}

TEST(Descent, StopsAtABoundAndAtTheLongestStep) {
  DescentProblem problem = free_problem();
  problem.upper(0) = 0.5;
  const DescentPoint end = gone(problem, 40, Learning::from_the_step_taken, true);
  EXPECT_DOUBLE_EQ(end.x(0), 0.5);
  EXPECT_NEAR(end.x(1), 0.25, 1e-6);
  problem.longest.setConstant(0.1);
  const DescentPoint at = begin_at(problem, VectorXd{{-1.2, 1}});
  const MatrixXd tries = tries_from(problem, at, kDampings);
  EXPECT_LE((tries.colwise() - at.x).cwiseAbs().maxCoeff(), 0.1 + 1e-12);
}

TEST(Descent, SeveralSideBySideGoAsEachAlone) {
  DescentProblem other = free_problem();
  other.upper(0) = 0.5;
  const std::vector<DescentProblem> problems = {free_problem(), other};
  std::vector<DescentPoint> both = {begin_at(problems[0], VectorXd{{-1.2, 1}}),
                                    begin_at(problems[1], VectorXd{{0.2, 2}})};
  std::vector<DescentPoint> first = {both[0]}, second = {both[1]};
  for (int round = 0; round < 5; ++round) {
    step(problems, both, kDampings, evaluate, Learning::from_every_try);
    step({problems[0]}, first, kDampings, evaluate, Learning::from_every_try);
    step({problems[1]}, second, kDampings, evaluate, Learning::from_every_try);
  }
  EXPECT_EQ(both[0].x, first[0].x);
  EXPECT_EQ(both[1].x, second[0].x);
}

TEST(Descent, APriorPullsAndCountsWhereItIsInTheCost) {
  DescentProblem problem = free_problem();
  problem.prior_weight.setConstant(1e3);
  problem.prior_centre = VectorXd{{-1.2, 1.44}};
  const DescentPoint pulled = gone(problem, 30, Learning::from_the_step_taken, true);
  EXPECT_LT((pulled.x - problem.prior_centre).norm(), 0.05);
  EXPECT_GT(cost_at(problem, VectorXd::Ones(2), VectorXd::Zero(2)), 1e3);
  problem.prior_in_cost = false;
  EXPECT_EQ(cost_at(problem, VectorXd::Ones(2), VectorXd::Zero(2)), 0);
}

TEST(Descent, ATryThatDivergedIsNotTaken) {
  const DescentProblem problem = free_problem();
  std::vector<DescentPoint> at = {begin_at(problem, VectorXd{{-1.2, 1}})};
  const auto none = [](const std::vector<MatrixXd>& tries) {
    return MatrixXd::Constant(2, tries[0].cols(), std::numeric_limits<double>::quiet_NaN());
  };
  EXPECT_EQ(step({problem}, at, kDampings, none, Learning::from_every_try).front().taken, -1);
  EXPECT_EQ(at[0].x, (VectorXd{{-1.2, 1}}));
}

TEST(Descent, GoesByTheRowsThatItIsGiven) {
  DescentProblem problem = free_problem();
  problem.spans = {{1, 1}};  // 1 − x₀ alone
  const DescentPoint at = begin_at(problem, VectorXd{{-1.2, 1}});
  const NormalEquations normal = normal_equations(problem, at);
  EXPECT_NEAR(normal.information(0, 0), 1, 1e-4);
  EXPECT_EQ(normal.information(1, 1), 0);
  EXPECT_NEAR(normal.gradient(0), -2.2, 1e-4);
}

}  // namespace
}  // namespace selvedge::estimate
