#include "fit/least_squares.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "fit/robust_cost.h"

namespace selvedge::fit {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Residuals of all fitted trials in one column, whitened; held-out and unseen ones are left out.
class Stack {
 public:
  Stack(const Objective& objective, const LeastSquaresOptions& options) {
    std::vector<size_t> trials = options.trials;
    if (trials.empty())
      for (size_t i = 0; i < objective.scenes().size(); ++i) trials.push_back(i);
    for (const size_t trial : trials) {
      const VectorXd sd = objective.sd_mm(trial), time = objective.time_s(trial);
      const bool still = objective.scenes()[trial].trial.still;
      for (Index i = 0; i < sd.size(); ++i)
        if (still || time(i) <= options.fit_until_s)
          rows_.push_back({trial, i, 1 / sd(i), static_cast<int>(trial) * 100000 + static_cast<int>(time(i) / 0.2)});
    }
  }

  VectorXd whitened(const Residuals& r) const {
    VectorXd out(static_cast<Index>(rows_.size()));
    for (size_t k = 0; k < rows_.size(); ++k) {
      const VectorXd& mm = r.mm[rows_[k].trial];
      const double value = mm.size() ? mm(rows_[k].index) : std::numeric_limits<double>::quiet_NaN();
      out(static_cast<Index>(k)) = std::isfinite(value) ? value * rows_[k].inverse_sd : 0;
    }
    return out;
  }

  int block(size_t k) const { return rows_[k].block; }
  size_t size() const { return rows_.size(); }

 private:
  struct Row {
    size_t trial;
    Index index;
    double inverse_sd;
    int block;
  };
  std::vector<Row> rows_;
};

VectorXd clipped(const std::vector<Parameter>& parameters, VectorXd x) {
  for (size_t k = 0; k < parameters.size(); ++k) {
    auto& value = x(static_cast<Index>(k));
    value = std::clamp(value, to_coordinate(parameters[k], parameters[k].lower), to_coordinate(parameters[k], parameters[k].upper));
  }
  return x;
}

// The point and one step along each coordinate, inwards where a bound is near.
MatrixXd difference_sets(const std::vector<Parameter>& parameters, const VectorXd& x, double step, VectorXd& taken) {
  const Index n = x.size();
  MatrixXd sets(n, n + 1);
  taken.resize(n);
  for (Index k = 0; k <= n; ++k) sets.col(k) = x;
  for (Index k = 0; k < n; ++k) {
    const Parameter& p = parameters[static_cast<size_t>(k)];
    taken(k) = x(k) + step > to_coordinate(p, p.upper) ? -step : step;
    sets(k, k + 1) += taken(k);
  }
  return sets;
}

// Sandwich: information⁻¹ (Σ_blocks g gᵀ) information⁻¹ with g a block's share of the gradient.
MatrixXd sandwich(const MatrixXd& information, const MatrixXd& jacobian, const VectorXd& weighted, const Stack& stack) {
  std::map<int, VectorXd> gradient;
  for (size_t k = 0; k < stack.size(); ++k) {
    const auto row = static_cast<Index>(k);
    auto [at, fresh] = gradient.try_emplace(stack.block(k), VectorXd::Zero(jacobian.cols()));
    at->second += weighted(row) * jacobian.row(row).transpose();
  }
  MatrixXd middle = MatrixXd::Zero(jacobian.cols(), jacobian.cols());
  for (const auto& [block, g] : gradient) middle += g * g.transpose();
  const double blocks = static_cast<double>(gradient.size()), p = static_cast<double>(jacobian.cols());
  middle *= blocks / std::max(1.0, blocks - p);
  const MatrixXd inverse = information.inverse();
  return inverse * middle * inverse;
}

}  // namespace

double cost_of(const Objective& objective, const Residuals& residuals, const LeastSquaresOptions& options, double scale) {
  return cauchy_cost(Stack(objective, options).whitened(residuals), options.cauchy * scale);
}

LeastSquaresResult minimise(Objective& objective, const std::vector<Parameter>& parameters, const VectorXd& start,
                            const LeastSquaresOptions& options) {
  const Stack stack(objective, options);
  const double prior = 1 / (options.prior_sd * options.prior_sd);
  LeastSquaresResult result;
  VectorXd x = clipped(parameters, start);
  const VectorXd prior_centre = x;
  double lambda = 1e-2;
  int small = 0;
  VectorXd r;
  MatrixXd jacobian;
  for (int iteration = 0; iteration <= options.max_iterations; ++iteration) {
    VectorXd taken;
    const MatrixXd sets = difference_sets(parameters, x, options.difference, taken);
    std::vector<Residuals> evaluated = objective.evaluate(parameters, sets, options.trials);
    result.evaluations += static_cast<int>(sets.cols());
    r = stack.whitened(evaluated[0]);
    jacobian.resize(r.size(), x.size());
    for (Index k = 0; k < x.size(); ++k) {
      if (evaluated[static_cast<size_t>(k) + 1].finite)
        jacobian.col(k) = (stack.whitened(evaluated[static_cast<size_t>(k) + 1]) - r) / taken(k);
      else
        jacobian.col(k).setZero();
    }
    objective.set_start(evaluated[0].start);
    const double scale = robust_scale(r), c = options.cauchy * scale;
    const VectorXd w = cauchy_weights(r, c);
    const double cost = cauchy_cost(r, c) + 0.5 * scale * scale * prior * (x - prior_centre).squaredNorm();
    if (iteration == 0) {
      result.residuals_start = evaluated[0];
      result.cost_start = cost;
    }
    result.history.push_back(cost);
    result.cost = cost;
    result.scale = scale;
    const MatrixXd normal = jacobian.transpose() * w.asDiagonal() * jacobian + scale * scale * prior * MatrixXd::Identity(x.size(), x.size());
    const VectorXd gradient = jacobian.transpose() * w.cwiseProduct(r) + scale * scale * prior * (x - prior_centre);
    result.information = normal;
    result.residuals = std::move(evaluated[0]);
    result.jacobian.clear();
    if (iteration == options.max_iterations || small >= 2) break;

    // Four dampings side by side; the best of them is the step.
    MatrixXd tries(x.size(), 4);
    double damping[4];
    for (int k = 0; k < 4; ++k) {
      damping[k] = lambda * std::pow(10.0, 2 * k - 2);
      const MatrixXd damped = normal + damping[k] * MatrixXd(normal.diagonal().asDiagonal());
      const VectorXd step = -damped.ldlt().solve(gradient);
      tries.col(k) = clipped(parameters, x + step.cwiseMax(-1.2).cwiseMin(1.2));
    }
    const std::vector<Residuals> tried = objective.evaluate(parameters, tries, options.trials);
    result.evaluations += 4;
    double best = cost;
    int chosen = -1;
    for (int k = 0; k < 4; ++k) {
      if (!tried[static_cast<size_t>(k)].finite) continue;
      const double value = cauchy_cost(stack.whitened(tried[static_cast<size_t>(k)]), c) +
                           0.5 * scale * scale * prior * (tries.col(k) - prior_centre).squaredNorm();
      if (value < best) {
        best = value;
        chosen = k;
      }
    }
    if (chosen < 0) {
      lambda *= 1e3;
      small += lambda > 1e6 ? 2 : 1;
    } else {
      small = (cost - best) / cost < options.least_decrease ? small + 1 : 0;
      x = tries.col(chosen);
      lambda = std::clamp(damping[chosen] * 0.3, 1e-7, 1e6);
    }
    options.progress((iteration + 1.0) / (options.max_iterations + 1.0),
                     fmt::format("cost {:.4g}, robust residual {:.2f} sd", best, scale));
  }
  result.coordinates = x;
  const VectorXd w = cauchy_weights(r, options.cauchy * result.scale);
  result.covariance = sandwich(result.information, jacobian, w.cwiseProduct(r), stack);
  options.progress(1, fmt::format("cost {:.4g}", result.cost));
  return result;
}

}  // namespace selvedge::fit
