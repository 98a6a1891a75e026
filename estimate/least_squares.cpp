#include "estimate/least_squares.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <Eigen/LU>
#include <fmt/format.h>

#include "estimate/bounded_step.h"
#include "estimate/journal.h"
#include "estimate/robust_cost.h"
#include "estimate/rows.h"

namespace selvedge::estimate {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd clipped(const std::vector<model::Parameter>& parameters, VectorXd x) {
  for (size_t k = 0; k < parameters.size(); ++k) {
    auto& value = x(static_cast<Index>(k));
    value = std::clamp(value, to_coordinate(parameters[k], parameters[k].lower),
                       to_coordinate(parameters[k], parameters[k].upper));
  }
  return x;
}

// The point and one step along each coordinate, inwards where a bound is near.
MatrixXd difference_sets(const std::vector<model::Parameter>& parameters, const VectorXd& x, double step,
                         VectorXd& taken) {
  const Index n = x.size();
  MatrixXd sets(n, n + 1);
  taken.resize(n);
  for (Index k = 0; k <= n; ++k) sets.col(k) = x;
  for (Index k = 0; k < n; ++k) {
    const model::Parameter& p = parameters[static_cast<size_t>(k)];
    taken(k) = x(k) + step > to_coordinate(p, p.upper) ? -step : step;
    sets(k, k + 1) += taken(k);
  }
  return sets;
}

// Σ_blocks g gᵀ with g a block's share of the gradient; a block is 0.2 s of a trial, or all of it.
MatrixXd gradient_squares(const MatrixXd& jacobian, const VectorXd& weighted, const Rows& rows, bool whole_trials) {
  std::map<int, VectorXd> gradient;
  for (Index row = 0; row < rows.size(); ++row) {
    auto [at, fresh] = gradient.try_emplace(whole_trials ? static_cast<int>(rows.trial(row)) : rows.block(row),
                                            VectorXd::Zero(jacobian.cols()));
    at->second += weighted(row) * jacobian.row(row).transpose();
  }
  MatrixXd sum = MatrixXd::Zero(jacobian.cols(), jacobian.cols());
  for (const auto& [block, g] : gradient) sum += g * g.transpose();
  const double blocks = static_cast<double>(gradient.size()),
               lost = whole_trials ? 1 : static_cast<double>(jacobian.cols());
  return sum * blocks / std::max(1.0, blocks - lost);
}

// Of each coordinate, 1 / sd².
VectorXd prior_precision(const std::vector<model::Parameter>& parameters, const LeastSquaresOptions& options) {
  VectorXd out(static_cast<Index>(parameters.size()));
  for (size_t k = 0; k < parameters.size(); ++k) {
    const double sd = options.prior_sd.value_or(parameters[k].prior_sd);
    out(static_cast<Index>(k)) = 1 / (sd * sd);
  }
  return out;
}

// Where an iteration begins.
struct Point {
  VectorXd x;
  double lambda = 1e-2;
  int small = 0;  // decreases too small to go on, in a row
};

class Minimiser {
 public:
  Minimiser(const model::Simulation& simulation, model::State& state, const std::vector<model::Parameter>& parameters,
            const VectorXd& start, const LeastSquaresOptions& options)
      : simulation_(simulation), state_(state), parameters_(parameters), options_(options),
        rows_(simulation, {options.trials, options.fit_until_s}), prior_(prior_precision(parameters, options)) {
    at_.x = clipped(parameters, start);
    prior_centre_ = options.prior_centre ? *options.prior_centre : at_.x;
    if (options.journal) name_ = options.journal->next("minimise");
  }

  LeastSquaresResult run() {
    for (int iteration = resume();; ++iteration) {
      if (options_.only_coordinates && (iteration >= options_.max_iterations || at_.small >= 2)) break;
      linearise();
      if (iteration >= options_.max_iterations || at_.small >= 2) break;
      step();
      for (int k = 0; k < options_.steps_between && moved_ && at_.small == 0; ++k) {
        update();
        step();
      }
      options_.progress((iteration + 1.0) / (options_.max_iterations + 1.0),
                        fmt::format("cost {:.4g}, robust residual {:.2f} sd", result_.cost, result_.scale));
      keep(iteration + 1);
    }
    result_.coordinates = at_.x;
    if (options_.only_coordinates) return std::move(result_);
    const VectorXd w = cauchy_weights(r_, options_.cauchy * result_.scale);
    const MatrixXd inverse = result_.information.inverse();
    // As evidence the prior is a row like the others, as uncertain as it says.
    MatrixXd prior = MatrixXd::Zero(at_.x.size(), at_.x.size());
    if (options_.prior_as_evidence) prior.diagonal() = prior_weights() * result_.scale * result_.scale * alike_;
    result_.covariance = inverse * (gradient_squares(jacobian_, w.cwiseProduct(r_), rows_, false) + prior) * inverse;
    result_.covariance_between_trials =
        inverse * (gradient_squares(jacobian_, w.cwiseProduct(r_), rows_, true) + prior) * inverse;
    options_.progress(1, fmt::format("cost {:.4g}", result_.cost));
    return std::move(result_);
  }

 private:
  VectorXd prior_weights() const { return result_.scale * result_.scale * alike_ * prior_; }
  double cost_of_prior(const VectorXd& x) const { return 0.5 * (x - prior_centre_).cwiseAbs2().dot(prior_weights()); }

  // By how much the variance of what is fitted exceeds that of residuals that know nothing of each other; the middle
  // one. Told from what no step would take away: far from the end residuals go together that will not be there.
  double rows_alike() const {
    const VectorXd w = cauchy_weights(r_, options_.cauchy * result_.scale);
    MatrixXd information = jacobian_.transpose() * w.asDiagonal() * jacobian_;
    information.diagonal().array() += 1e-9 * information.trace();  // what does not show at all
    const MatrixXd inverse = information.inverse();
    const VectorXd left = r_ - jacobian_ * (inverse * (jacobian_.transpose() * w.cwiseProduct(r_)));
    const VectorXd found =
        (inverse * gradient_squares(jacobian_, w.cwiseProduct(left), rows_, false) * inverse).diagonal();
    VectorXd ratio = found.cwiseQuotient(inverse.diagonal()) / (result_.scale * result_.scale);
    std::nth_element(ratio.begin(), ratio.begin() + ratio.size() / 2, ratio.end());
    return std::max(1.0, ratio(ratio.size() / 2));
  }

  // Residuals, derivatives and the normal equations at the point.
  void linearise() {
    VectorXd taken;
    const MatrixXd sets = difference_sets(parameters_, at_.x, options_.difference, taken);
    std::vector<model::Residuals> evaluated = simulation_.evaluate(state_, parameters_, sets, options_.trials);
    result_.evaluations += static_cast<int>(sets.cols());
    r_ = rows_.whitened(evaluated[0]);
    jacobian_ = MatrixXd::Zero(r_.size(), at_.x.size());
    for (Index k = 0; k < at_.x.size(); ++k)
      if (evaluated[static_cast<size_t>(k) + 1].finite)
        jacobian_.col(k) = (rows_.whitened(evaluated[static_cast<size_t>(k) + 1]) - r_) / taken(k);
    simulation_.take_branches(state_, evaluated[0].start);
    result_.scale = robust_scale(r_);
    result_.residuals = std::move(evaluated[0]);
    if (options_.prior_as_evidence) alike_ = rows_alike();
    weigh();
    result_.history.push_back(result_.cost);
  }

  // The normal equations at the point.
  void weigh() {
    const double c = options_.cauchy * result_.scale;
    const VectorXd weight = prior_weights();
    const VectorXd w = cauchy_weights(r_, c);
    result_.cost = cauchy_cost(r_, c) + cost_of_prior(at_.x);
    result_.information = jacobian_.transpose() * w.asDiagonal() * jacobian_ + MatrixXd(weight.asDiagonal());
    gradient_ = jacobian_.transpose() * w.cwiseProduct(r_) + weight.cwiseProduct(at_.x - prior_centre_);
  }

  // Derivatives after a step, from what the residuals did over it (Broyden 1965).
  void update() {
    jacobian_ += (stepped_r_ - r_ - jacobian_ * stepped_) * stepped_.transpose() / stepped_.squaredNorm();
    r_ = std::move(stepped_r_);
    weigh();
  }

  // Four dampings side by side; the best of them is the step.
  void step() {
    MatrixXd tries(at_.x.size(), 4);
    double damping[4];
    const auto [lower, upper] = bounds_of(parameters_);
    for (int k = 0; k < 4; ++k) {
      damping[k] = at_.lambda * std::pow(10.0, 2 * k - 2);
      const MatrixXd damped = result_.information + damping[k] * MatrixXd(result_.information.diagonal().asDiagonal());
      const VectorXd step = bounded_step(damped, gradient_, lower - at_.x, upper - at_.x);
      tries.col(k) = clipped(parameters_, at_.x + step.cwiseMax(-1.2).cwiseMin(1.2));
    }
    const std::vector<model::Residuals> tried = simulation_.evaluate(state_, parameters_, tries, options_.trials);
    result_.evaluations += 4;
    double best = result_.cost;
    int chosen = -1;
    for (int k = 0; k < 4; ++k) {
      if (!tried[static_cast<size_t>(k)].finite) continue;
      VectorXd r = rows_.whitened(tried[static_cast<size_t>(k)]);
      const double value = cauchy_cost(r, options_.cauchy * result_.scale) + cost_of_prior(tries.col(k));
      if (value >= best) continue;
      best = value;
      chosen = k;
      stepped_r_ = std::move(r);
    }
    moved_ = chosen >= 0 && (tries.col(chosen) - at_.x).squaredNorm() > 1e-16;
    if (chosen < 0) {
      at_.lambda *= 1e3;
      at_.small += at_.lambda > 1e6 ? 2 : 1;
      return;
    }
    at_.small = (result_.cost - best) / result_.cost < options_.least_decrease ? at_.small + 1 : 0;
    stepped_ = tries.col(chosen) - at_.x;
    at_.x = tries.col(chosen);
    at_.lambda = std::clamp(damping[chosen] * 0.3, 1e-7, 1e6);
  }

  // The last iteration that was kept of this call, in an earlier run.
  int resume() {
    if (!options_.journal) return 0;
    for (int iteration = options_.max_iterations; iteration > 0; --iteration)
      if (const auto* kept = options_.journal->find(name_ + " iteration " + std::to_string(iteration))) {
        restore(*kept);
        return iteration;
      }
    return 0;
  }

  void keep(int iteration) {
    if (!options_.journal) return;
    std::vector<double> kept = {at_.lambda, static_cast<double>(at_.small), static_cast<double>(result_.evaluations),
                                static_cast<double>(result_.history.size())};
    kept.insert(kept.end(), result_.history.begin(), result_.history.end());
    kept.insert(kept.end(), at_.x.begin(), at_.x.end());
    for (const Eigen::Matrix3Xd& shape : state_.branch)
      kept.insert(kept.end(), shape.data(), shape.data() + shape.size());
    options_.journal->keep(name_ + " iteration " + std::to_string(iteration), kept);
  }

  void restore(const std::vector<double>& kept) {
    auto from = kept.begin();
    const auto take = [&](Index count) {
      const VectorXd numbers = Eigen::Map<const VectorXd>(&*from, count);
      from += count;
      return numbers;
    };
    const VectorXd head = take(4);
    at_.lambda = head(0);
    at_.small = static_cast<int>(head(1));
    result_.evaluations = static_cast<int>(head(2));
    const VectorXd history = take(static_cast<Index>(head(3)));
    result_.history.assign(history.begin(), history.end());
    at_.x = take(at_.x.size());
    std::vector<Eigen::Matrix3Xd> shapes;
    for (const Eigen::Matrix3Xd& shape : state_.branch) shapes.push_back(take(shape.size()).reshaped(3, shape.cols()));
    simulation_.take_branches(state_, shapes);
  }

  const model::Simulation& simulation_;
  model::State& state_;
  const std::vector<model::Parameter>& parameters_;
  const LeastSquaresOptions& options_;
  const Rows rows_;
  const VectorXd prior_;  // precision of each coordinate
  double alike_ = 1;      // residuals that count as one against the prior
  VectorXd prior_centre_;
  std::string name_;  // in the journal
  Point at_;
  VectorXd r_, gradient_;
  VectorXd stepped_, stepped_r_;  // the last step, and the residuals at its end
  bool moved_ = false;            // it led anywhere
  MatrixXd jacobian_;
  LeastSquaresResult result_;
};

}  // namespace

double cost_of(const model::Simulation& simulation, const model::Residuals& residuals,
               const LeastSquaresOptions& options, double scale) {
  const Rows rows(simulation, {options.trials, options.fit_until_s});
  return cauchy_cost(rows.whitened(residuals), options.cauchy * scale);
}

LeastSquaresResult minimise(const model::Simulation& simulation, model::State& state,
                            const std::vector<model::Parameter>& parameters, const VectorXd& start,
                            const LeastSquaresOptions& options) {
  return Minimiser(simulation, state, parameters, start, options).run();
}

}  // namespace selvedge::estimate
