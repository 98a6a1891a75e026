#include "estimate/least_squares.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include <Eigen/LU>
#include <fmt/format.h>

#include "estimate/descent.h"
#include "estimate/journal.h"
#include "estimate/robust_cost.h"
#include "estimate/rows.h"
#include "geometry/order_statistics.h"

namespace selvedge::estimate {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLongestStep = 1.2;  // in coordinates

// The point and a step along each coordinate, inwards where a bound is near.
MatrixXd difference_sets(const VectorXd& upper, const VectorXd& x, const VectorXd& step, VectorXd& taken) {
  const Index n = x.size();
  MatrixXd sets(n, n + 1);
  taken.resize(n);
  for (Index k = 0; k <= n; ++k) sets.col(k) = x;
  for (Index k = 0; k < n; ++k) {
    taken(k) = x(k) + step(k) > upper(k) ? -step(k) : step(k);
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
    const bool measured = parameters[k].measured;
    const double sd = measured ? parameters[k].prior_sd : options.prior_sd.value_or(parameters[k].prior_sd);
    out(static_cast<Index>(k)) = 1 / (sd * sd);
  }
  return out;
}

class Minimiser {
 public:
  Minimiser(const model::Simulation& simulation, model::State& state, const std::vector<model::Parameter>& parameters,
            const VectorXd& start, const LeastSquaresOptions& options)
      : simulation_(simulation), state_(state), parameters_(parameters), options_(options),
        rows_(simulation, {options.trials, options.fit_until_s}), prior_(prior_precision(parameters, options)) {
    std::tie(problem_.lower, problem_.upper) = bounds_of(parameters);
    problem_.longest = VectorXd::Constant(start.size(), kLongestStep);
    at_.x = start.cwiseMax(problem_.lower).cwiseMin(problem_.upper);
    problem_.prior_centre = options.prior_centre.value_or(at_.x);
    for (size_t k = 0; k < parameters.size(); ++k)
      if (parameters[k].measured)
        problem_.prior_centre(static_cast<Index>(k)) = to_coordinate(parameters[k], parameters[k].start);
    difference_ = VectorXd::Constant(start.size(), options.difference);
    if (options.journal) name_ = options.journal->next("minimise");
  }

  LeastSquaresResult run() {
    for (int iteration = resume();; ++iteration) {
      const bool ends = iteration >= options_.max_iterations || small_ >= 2;
      if (ends && options_.only_coordinates) break;
      linearise();
      if (ends) break;
      bool moved = take_step(true);
      for (int k = 0; k < options_.steps_between && moved && small_ == 0; ++k) moved = take_step(false);
      options_.progress((iteration + 1.0) / (options_.max_iterations + 1.0),
                        fmt::format("cost {:.4g}, robust residual {:.2f} sd", at_.cost, result_.scale));
      keep(iteration + 1);
    }
    result_.coordinates = at_.x;
    result_.cost = at_.cost;
    if (!options_.only_coordinates) judge();
    return std::move(result_);
  }

 private:
  // How well the end is determined.
  void judge() {
    result_.information = normal_equations(problem_, at_).information;
    result_.information.diagonal() += problem_.prior_weight;
    const VectorXd weighted = cauchy_weights(at_.residual, problem_.cauchy).cwiseProduct(at_.residual);
    const MatrixXd inverse = result_.information.inverse();
    // As evidence the prior is a row like the others, as uncertain as it says.
    MatrixXd prior = MatrixXd::Zero(at_.x.size(), at_.x.size());
    if (options_.prior_as_evidence) prior.diagonal() = problem_.prior_weight * result_.scale * result_.scale * alike_;
    const auto sandwich = [&](bool whole_trials) -> MatrixXd {
      return inverse * (gradient_squares(at_.jacobian, weighted, rows_, whole_trials) + prior) * inverse;
    };
    result_.covariance = sandwich(false);
    result_.covariance_between_trials = sandwich(true);
    options_.progress(1, fmt::format("cost {:.4g}", result_.cost));
  }

  // By how much the variance of what is fitted exceeds that of residuals that know nothing of each other; the middle
  // one. Told from what no step would take away: far from the end residuals go together that will not be there.
  double rows_alike() const {
    const VectorXd w = cauchy_weights(at_.residual, problem_.cauchy);
    MatrixXd information = at_.jacobian.transpose() * w.asDiagonal() * at_.jacobian;
    information.diagonal().array() += 1e-9 * information.trace();  // what does not show at all
    const MatrixXd inverse = information.inverse();
    const VectorXd left =
        at_.residual - at_.jacobian * (inverse * (at_.jacobian.transpose() * w.cwiseProduct(at_.residual)));
    const VectorXd found =
        (inverse * gradient_squares(at_.jacobian, w.cwiseProduct(left), rows_, false) * inverse).diagonal();
    const VectorXd ratio = found.cwiseQuotient(inverse.diagonal()) / (result_.scale * result_.scale);
    return std::max(1.0, geometry::median(std::vector<double>(ratio.begin(), ratio.end())));
  }

  // Residuals, their scale and derivatives at the point, and what the prior weighs there.
  void linearise() {
    VectorXd taken;
    const MatrixXd sets = difference_sets(problem_.upper, at_.x, difference_, taken);
    std::vector<model::Residuals> evaluated = simulation_.evaluate(state_, parameters_, sets, options_.trials);
    result_.evaluations += static_cast<int>(sets.cols());
    at_.residual = rows_.whitened(evaluated[0]);
    at_.jacobian = MatrixXd::Zero(at_.residual.size(), at_.x.size());
    for (Index k = 0; k < at_.x.size(); ++k)
      if (evaluated[static_cast<size_t>(k) + 1].finite)
        at_.jacobian.col(k) = (rows_.whitened(evaluated[static_cast<size_t>(k) + 1]) - at_.residual) / taken(k);
    simulation_.take_branches(state_, evaluated[0].start);
    result_.scale = robust_scale(at_.residual);
    result_.residuals = std::move(evaluated[0]);
    problem_.cauchy = kCauchy * result_.scale;
    if (options_.prior_as_evidence) alike_ = rows_alike();
    problem_.prior_weight = result_.scale * result_.scale * alike_ * prior_;
    at_.cost = cost_at(problem_, at_.x, at_.residual);
    choose_differences();
    result_.history.push_back(at_.cost);
  }

  // Of what hardly shows, a small change is lost in the roundings of a simulation: the next derivatives are taken over
  // a share of what is left open.
  void choose_differences() {
    constexpr double kOfOpen = 0.3, kMost = 0.3;
    MatrixXd information = normal_equations(problem_, at_).information;
    information.diagonal() += problem_.prior_weight;
    const VectorXd open = result_.scale * information.inverse().diagonal().cwiseMax(0).cwiseSqrt();
    difference_ = (kOfOpen * open).cwiseMin(kMost).cwiseMax(options_.difference);
  }

  // One round of four dampings. True where it led anywhere. Where it did not, derivatives of this very point say that
  // the end is near; those of the point before say nothing.
  bool take_step(bool derivatives_are_new) {
    const std::vector<double> dampings = {lambda_ * 1e-2, lambda_, lambda_ * 1e2, lambda_ * 1e4};
    std::vector<DescentPoint> point = {std::move(at_)};
    const DescentStep taken = step(
                                  {problem_}, point, dampings,
                                  [&](const std::vector<MatrixXd>& tries) {
      return rows_.whitened(simulation_.evaluate(state_, parameters_, tries[0], options_.trials));
                                  },
                                  Learning::from_the_step_taken)
        .front();
    at_ = std::move(point.front());
    result_.evaluations += static_cast<int>(dampings.size());
    if (taken.taken < 0) {
      if (!derivatives_are_new) return false;
      lambda_ *= 1e3;
      small_ += lambda_ > 1e6 ? 2 : 1;
      return false;
    }
    if (taken.decrease >= options_.least_decrease) small_ = 0;
    else if (derivatives_are_new) ++small_;
    lambda_ = std::clamp(dampings[static_cast<size_t>(taken.taken)] * 0.3, 1e-7, 1e6);
    return taken.length > 1e-8;
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
    std::vector<double> kept = {lambda_, static_cast<double>(small_), static_cast<double>(result_.evaluations),
                                static_cast<double>(result_.history.size())};
    kept.insert(kept.end(), result_.history.begin(), result_.history.end());
    kept.insert(kept.end(), at_.x.begin(), at_.x.end());
    kept.insert(kept.end(), difference_.begin(), difference_.end());
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
    lambda_ = head(0);
    small_ = static_cast<int>(head(1));
    result_.evaluations = static_cast<int>(head(2));
    const VectorXd history = take(static_cast<Index>(head(3)));
    result_.history.assign(history.begin(), history.end());
    at_.x = take(at_.x.size());
    difference_ = take(at_.x.size());
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
  VectorXd difference_;   // over which derivatives are taken, of each coordinate
  double alike_ = 1;      // residuals that count as one against the prior
  std::string name_;      // in the journal
  DescentProblem problem_;
  DescentPoint at_;
  double lambda_ = 1e-2;
  int small_ = 0;  // decreases too small to go on, in a row
  LeastSquaresResult result_;
};

}  // namespace

double cost_of(const model::Simulation& simulation, const model::Residuals& residuals,
               const LeastSquaresOptions& options) {
  if (!residuals.finite) return std::numeric_limits<double>::infinity();
  return cauchy_cost(Rows(simulation, {options.trials, options.fit_until_s}).whitened(residuals), kCauchy);
}

std::vector<double> costs_of(const model::Simulation& simulation, const model::State& state,
                             const std::vector<model::Parameter>& parameters, const MatrixXd& sets,
                             const LeastSquaresOptions& options) {
  std::vector<double> costs;
  for (const model::Residuals& r : simulation.evaluate(state, parameters, sets, options.trials))
    costs.push_back(cost_of(simulation, r, options));
  return costs;
}

LeastSquaresResult minimise(const model::Simulation& simulation, model::State& state,
                            const std::vector<model::Parameter>& parameters, const VectorXd& start,
                            const LeastSquaresOptions& options) {
  return Minimiser(simulation, state, parameters, start, options).run();
}

}  // namespace selvedge::estimate
