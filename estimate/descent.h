// The solver of damped least squares (Levenberg–Marquardt): steps of one problem, or of several side by side.
//
// Minimises the robust cost ½ c² Σ ln(1 + (r/c)²) (robust_cost.h) within bounds, with a prior that pulls towards its
// centre. A round tries several dampings of each problem's Gauss–Newton step; all tries of all problems are evaluated
// as one batch, which goes through the simulation in SIMD lanes, and of each problem the best that lessens its cost is
// taken. Derivatives are brought up to date by what the residuals did (Broyden 1965). Who takes them afresh, and when
// it is enough, says the caller: least_squares.h.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

namespace selvedge::estimate {

struct RowSpan {
  Eigen::Index first = 0, count = 0;
};

// What is minimised; one entry a coordinate.
struct DescentProblem {
  Eigen::VectorXd lower, upper;  // bounds
  Eigen::VectorXd longest;       // of a step
  Eigen::VectorXd prior_centre, prior_weight;
  // The prior is a row like the others: it counts in the cost and is damped with them. Otherwise it bends steps alone.
  bool prior_in_cost = true;
  double cauchy = 1;           // c of the robust cost
  std::vector<RowSpan> spans;  // rows that steps go by; empty: all
};

// Where a descent stands.
struct DescentPoint {
  Eigen::VectorXd x, residual;
  Eigen::MatrixXd jacobian;  // of the residual by x
  double cost = 0;
};

// Jᵀ W J of the rows, and Jᵀ W r, without the prior; W: Cauchy's weights.
struct NormalEquations {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
};
NormalEquations normal_equations(const DescentProblem& problem, const DescentPoint& at);

// Robust cost of residuals at x, with the prior where that counts.
double cost_at(const DescentProblem& problem, const Eigen::VectorXd& x, const Eigen::VectorXd& residual);

// Where the step of each damping leads, a column each, within bounds.
Eigen::MatrixXd tries_from(const DescentProblem& problem, const DescentPoint& at, const std::vector<double>& dampings);

// Residuals at the tries of all problems, a column each, one problem's after the other's; NaN where one diverged.
using EvaluateTries = std::function<Eigen::MatrixXd(const std::vector<Eigen::MatrixXd>& tries)>;

// Which tries correct the derivatives.
enum class Learning { from_the_step_taken, from_every_try };

// What became of a round.
struct DescentStep {
  int taken = -1;       // which damping; -1: none lessens the cost
  double length = 0;    // of the step
  double decrease = 0;  // of the cost, relative
};

// One round: each point of `at` goes where its problem's best try leads.
std::vector<DescentStep> step(const std::vector<DescentProblem>& problems, std::vector<DescentPoint>& at,
                              const std::vector<double>& dampings, const EvaluateTries& evaluate, Learning learning);

}  // namespace selvedge::estimate
