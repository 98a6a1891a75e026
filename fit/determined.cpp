#include "fit/determined.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include "report/text_table.h"

namespace selvedge::fit {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kMostUnseen = 6.9;  // a factor of a thousand: more is not told from it

// In words, of parameters that may rise together, and of others that would fall.
std::string unseen_change(const std::string& up, const std::string& down, double factor) {
  const std::string by = factor > 0.98 * std::exp(kMostUnseen) ? "a thousand or more" : report::short_number(factor, 2);
  const std::string& some = up.empty() ? down : up;
  if (up.empty() || down.empty())
    return some.find(" and ") == std::string::npos
               ? fmt::format("{} could be larger or smaller by a factor of {} and these trials would not show it", some,
                             by)
               : fmt::format("{} could grow or shrink together by a factor of {} and these trials would not show it",
                             some, by);
  return fmt::format(
      "{} could grow while {} shrinks, or the other way round, by a factor of {} in all, and these trials "
      "would not show it",
      up, down, by);
}

}  // namespace

void judge_parameters(FitOutcome& out, const std::vector<model::Parameter>& parameters, const VectorXd& start,
                      const estimate::LeastSquaresResult& fit, const VectorXd& mesh) {
  for (size_t k = 0; k < parameters.size(); ++k) {
    const auto at = static_cast<Index>(k);
    const model::Parameter& p = parameters[k];
    FittedParameter f;
    f.parameter = p;
    f.value = to_value(p, fit.coordinates(at));
    f.start = to_value(p, start(at));
    const double half = 1.645 * std::hypot(std::sqrt(std::max(0.0, fit.covariance(at, at))), mesh(at));
    f.mesh_percent =
        100 * std::abs(p.logarithmic ? mesh(at) : mesh(at) * p.scale / std::max(std::abs(f.value), 1e-300));
    // A linear interval of a coordinate that nothing determines would run off the range: bounds end it.
    f.lower_interval = std::clamp(to_value(p, std::max(fit.coordinates(at) - half, -700.0)), p.lower, p.upper);
    f.upper_interval = std::clamp(to_value(p, std::min(fit.coordinates(at) + half, 700.0)), p.lower, p.upper);
    // E(p + δ) ≈ E + ½ δ² H: the change for 1 % of the error.
    const double delta = std::sqrt(2 * 0.01 * fit.cost / std::max(fit.information(at, at), 1e-300));
    f.variability_percent = 100 * (p.logarithmic ? delta : delta * p.scale / std::max(std::abs(f.value), 1e-300));
    const double nearly = 0.01 * (p.logarithmic ? std::abs(f.value) : p.upper - p.lower);
    f.at_bound = f.value <= p.lower + nearly || f.value >= p.upper - nearly;
    // Where the trials say less of it than the pull to the start, its whole range is open.
    const double pull = std::pow(fit.scale / p.prior_sd, 2);
    const bool unseen = fit.information(at, at) < 2 * pull;
    if (unseen && p.measured) {
      f.lower_interval = to_value(p, to_coordinate(p, p.start) - 1.645 * p.prior_sd);
      f.upper_interval = to_value(p, to_coordinate(p, p.start) + 1.645 * p.prior_sd);
      out.remarks.push_back(fmt::format("{} is known from material tests alone: these motions do not show it", p.name));
    } else if (unseen) {
      f.lower_interval = p.lower;
      f.upper_interval = p.upper;
      out.remarks.push_back(
          fmt::format("{} does not show in these trials: its value is where the search left it", p.name));
    }
    f.determined = !f.at_bound && (!unseen || p.measured) && f.upper_interval < 1.25 * f.value &&
                   f.lower_interval > f.value / 1.25;
    if (f.at_bound) out.remarks.push_back(fmt::format("{} ends at its bound {:.3g} {}", p.name, f.value, p.unit));
    out.parameters.push_back(std::move(f));
  }
}

void name_weak_combinations(FitOutcome& out, const std::vector<model::Parameter>& parameters,
                            const estimate::LeastSquaresResult& fit) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(fit.covariance);
  for (Index i = solver.eigenvalues().size() - 1; i >= 0; --i) {
    if (solver.eigenvalues()(i) < 0.25 * 0.25) break;
    std::string up, down;
    for (size_t k = 0; k < parameters.size(); ++k) {
      const double weight = solver.eigenvectors()(static_cast<Index>(k), i);
      std::string& side = weight > 0 ? up : down;
      if (std::abs(weight) > 0.3) side += (side.empty() ? "" : " and ") + parameters[k].name;
    }
    out.combinations.push_back(
        unseen_change(up, down, std::exp(std::min(1.645 * std::sqrt(solver.eigenvalues()(i)), kMostUnseen))));
  }
}

void find_correlation(FitOutcome& out, const estimate::LeastSquaresResult& fit) {
  const VectorXd sd = fit.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  out.correlation = fit.covariance.cwiseQuotient((sd * sd.transpose()).cwiseMax(1e-300));
}

}  // namespace selvedge::fit
