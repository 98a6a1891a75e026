#include "fit/coarse_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "estimate/journal.h"

namespace selvedge::fit {

namespace {

Eigen::MatrixXd all_combinations(const std::vector<model::Parameter>& parameters) {
  std::vector<Eigen::VectorXd> sets(1, Eigen::VectorXd(static_cast<Eigen::Index>(parameters.size())));
  for (size_t k = 0; k < parameters.size(); ++k)
    sets[0](static_cast<Eigen::Index>(k)) = to_coordinate(parameters[k], parameters[k].start);
  const size_t stretch = place_of(parameters, "stretch");
  const auto shear = static_cast<Eigen::Index>(place_of(parameters, "shear"));
  for (size_t k = 0; k < parameters.size(); ++k) {
    if (parameters[k].tried.empty()) continue;
    std::vector<Eigen::VectorXd> more;
    for (const Eigen::VectorXd& set : sets)
      for (const double value : parameters[k].tried) {
        more.push_back(set);
        more.back()(static_cast<Eigen::Index>(k)) = to_coordinate(parameters[k], value);
        // Shear follows stretch, as it does in the fabrics of both papers.
        if (k == stretch && shear < set.size()) more.back()(shear) = std::log(value / 2);
      }
    sets = std::move(more);
  }
  Eigen::MatrixXd columns(sets[0].size(), static_cast<Eigen::Index>(sets.size()));
  for (size_t i = 0; i < sets.size(); ++i) columns.col(static_cast<Eigen::Index>(i)) = sets[i];
  return columns;
}

// As the journal has them, or computed.
std::vector<double> kept_costs(const model::Simulation& simulation, const model::State& state,
                               const std::vector<model::Parameter>& parameters, const Eigen::MatrixXd& sets,
                               const estimate::LeastSquaresOptions& options, const std::string& name) {
  if (options.journal)
    if (const auto* kept = options.journal->find(name)) return *kept;
  std::vector<double> costs = costs_of(simulation, state, parameters, sets, options);
  if (options.journal) options.journal->keep(name, costs);
  return costs;
}

}  // namespace

CoarseResult coarse_search(const model::Simulation& simulation, const model::State& state,
                           const std::vector<model::Parameter>& parameters,
                           const estimate::LeastSquaresOptions& options, size_t keep) {
  const Eigen::MatrixXd sets = all_combinations(parameters);
  std::vector<std::pair<double, Eigen::Index>> costs;
  double least = std::numeric_limits<double>::infinity();
  constexpr Eigen::Index kAtOnce = 16;
  const std::string name = options.journal ? options.journal->next("grid") : "";
  for (Eigen::Index first = 0; first < sets.cols(); first += kAtOnce) {
    const Eigen::Index count = std::min(kAtOnce, sets.cols() - first);
    const std::vector<double> some = kept_costs(simulation, state, parameters, sets.middleCols(first, count), options,
                                                name + " from " + std::to_string(first));
    for (Eigen::Index i = 0; i < count; ++i) {
      const double cost = some[static_cast<size_t>(i)];
      if (!std::isfinite(cost)) continue;
      costs.emplace_back(cost, first + i);
      least = std::min(least, cost);
    }
    options.progress(static_cast<double>(first + count) / static_cast<double>(sets.cols()),
                     fmt::format("coarse grid, best cost {:.4g}", least));
  }
  std::sort(costs.begin(), costs.end());
  if (costs.empty()) costs.emplace_back(std::numeric_limits<double>::infinity(), 0);
  CoarseResult out;
  out.evaluations = static_cast<int>(sets.cols());
  for (size_t i = 0; i < std::min(keep, costs.size()); ++i) {
    out.best.emplace_back(sets.col(costs[i].second));
    out.costs.push_back(costs[i].first);
  }
  return out;
}

}  // namespace selvedge::fit
