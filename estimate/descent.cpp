#include "estimate/descent.h"

#include "estimate/bounded_step.h"
#include "estimate/robust_cost.h"

namespace selvedge::estimate {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Derivatives after a change of x, from what the residuals did over it.
void learn(DescentPoint& at, const VectorXd& x, const VectorXd& residual) {
  const VectorXd moved = x - at.x;
  const double squared = moved.squaredNorm();
  if (squared <= 1e-12) return;
  const VectorXd wrong = residual - at.residual - at.jacobian * moved;
  at.jacobian += wrong * moved.transpose() / squared;
}

// r: residuals at the tries, a column each.
DescentStep take_best(const DescentProblem& problem, DescentPoint& at, const MatrixXd& tries, const MatrixXd& r,
                      Learning learning) {
  DescentStep out;
  double least = at.cost;
  for (Index k = 0; k < tries.cols(); ++k) {
    if (!r.col(k).allFinite()) continue;
    if (learning == Learning::from_every_try) learn(at, tries.col(k), r.col(k));
    const double cost = cost_at(problem, tries.col(k), r.col(k));
    if (!(cost < least)) continue;
    least = cost;
    out.taken = static_cast<int>(k);
  }
  if (out.taken < 0) return out;
  if (learning == Learning::from_the_step_taken) learn(at, tries.col(out.taken), r.col(out.taken));
  out.length = (tries.col(out.taken) - at.x).norm();
  out.decrease = (at.cost - least) / at.cost;
  at.x = tries.col(out.taken);
  at.residual = r.col(out.taken);
  at.cost = least;
  return out;
}

}  // namespace

NormalEquations normal_equations(const DescentProblem& problem, const DescentPoint& at) {
  const Index n = at.x.size();
  NormalEquations out{MatrixXd::Zero(n, n), VectorXd::Zero(n)};
  const std::vector<RowSpan> all = {{0, at.residual.size()}};
  for (const RowSpan& span : problem.spans.empty() ? all : problem.spans) {
    const VectorXd r = at.residual.segment(span.first, span.count), w = cauchy_weights(r, problem.cauchy);
    const auto j = at.jacobian.middleRows(span.first, span.count);
    out.information += j.transpose() * w.asDiagonal() * j;
    out.gradient += j.transpose() * w.cwiseProduct(r);
  }
  return out;
}

double cost_at(const DescentProblem& problem, const VectorXd& x, const VectorXd& residual) {
  const double cost = cauchy_cost(residual, problem.cauchy);
  if (!problem.prior_in_cost) return cost;
  return cost + 0.5 * (x - problem.prior_centre).cwiseAbs2().dot(problem.prior_weight);
}

MatrixXd tries_from(const DescentProblem& problem, const DescentPoint& at, const std::vector<double>& dampings) {
  auto [information, gradient] = normal_equations(problem, at);
  gradient += problem.prior_weight.cwiseProduct(at.x - problem.prior_centre);
  if (problem.prior_in_cost) information.diagonal() += problem.prior_weight;
  MatrixXd tries(at.x.size(), static_cast<Index>(dampings.size()));
  for (Index k = 0; k < tries.cols(); ++k) {
    MatrixXd damped = information;
    if (problem.prior_in_cost) damped.diagonal() += dampings[static_cast<size_t>(k)] * information.diagonal();
    else damped.diagonal() += problem.prior_weight + dampings[static_cast<size_t>(k)] * information.diagonal();
    const VectorXd step = bounded_step(damped, gradient, problem.lower - at.x, problem.upper - at.x);
    const VectorXd to = at.x + step.cwiseMax(-problem.longest).cwiseMin(problem.longest);
    tries.col(k) = to.cwiseMax(problem.lower).cwiseMin(problem.upper);
  }
  return tries;
}

std::vector<DescentStep> step(const std::vector<DescentProblem>& problems, std::vector<DescentPoint>& at,
                              const std::vector<double>& dampings, const EvaluateTries& evaluate, Learning learning) {
  std::vector<MatrixXd> tries;
  for (size_t i = 0; i < at.size(); ++i) tries.push_back(tries_from(problems[i], at[i], dampings));
  const MatrixXd r = evaluate(tries);
  const auto each = static_cast<Index>(dampings.size());
  std::vector<DescentStep> out;
  for (size_t i = 0; i < at.size(); ++i)
    out.push_back(take_best(problems[i], at[i], tries[i], r.middleCols(static_cast<Index>(i) * each, each), learning));
  return out;
}

}  // namespace selvedge::estimate
