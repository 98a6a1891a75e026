#include "fit/coarse_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "fit/fit_journal.h"

namespace selvedge::fit {

namespace {

// Which parameters decide where the optimiser should start, and the values tried. Shear follows stretch, as
// it does in the fabrics of both papers; damping hardly moves the optimum.
const std::map<std::string, std::vector<double>>& values_tried() {
  static const std::map<std::string, std::vector<double>> values = {
      {"bend", {2e-6, 1.6e-5, 1.2e-4, 9e-4}},
      {"stretch", {30, 110, 400, 1500}},
      {"drag_normal", {0.3, 0.8, 2, 5}},
      {"drag_linear", {0.1, 0.3, 1, 3}},
  };
  return values;
}

Eigen::MatrixXd all_combinations(const std::vector<Parameter>& parameters) {
  std::vector<Eigen::VectorXd> sets(1, Eigen::VectorXd(static_cast<Eigen::Index>(parameters.size())));
  for (size_t k = 0; k < parameters.size(); ++k)
    sets[0](static_cast<Eigen::Index>(k)) = to_coordinate(parameters[k], parameters[k].start);
  std::map<std::string, Eigen::Index> index;
  for (size_t k = 0; k < parameters.size(); ++k) index[parameters[k].name] = static_cast<Eigen::Index>(k);
  for (const auto& [name, values] : values_tried()) {
    const auto at = index.find(name);
    if (at == index.end()) continue;
    std::vector<Eigen::VectorXd> more;
    for (const Eigen::VectorXd& set : sets)
      for (const double value : values) {
        more.push_back(set);
        more.back()(at->second) = std::log(value);
        if (name == "stretch" && index.count("shear")) more.back()(index["shear"]) = std::log(value / 2);
      }
    sets = std::move(more);
  }
  Eigen::MatrixXd columns(sets[0].size(), static_cast<Eigen::Index>(sets.size()));
  for (size_t i = 0; i < sets.size(); ++i) columns.col(static_cast<Eigen::Index>(i)) = sets[i];
  return columns;
}

// Infinity where a simulation blew up.
std::vector<double> costs_of(const Objective& objective, const std::vector<Parameter>& parameters,
                             const Eigen::MatrixXd& sets, const LeastSquaresOptions& options, const std::string& name) {
  if (options.journal)
    if (const auto* kept = options.journal->find(name)) return *kept;
  std::vector<double> costs;
  for (const Residuals& r : objective.evaluate(parameters, sets, options.trials))
    costs.push_back(r.finite ? cost_of(objective, r, options, 1) : std::numeric_limits<double>::infinity());
  if (options.journal) options.journal->keep(name, costs);
  return costs;
}

}  // namespace

CoarseResult coarse_search(const Objective& objective, const std::vector<Parameter>& parameters,
                           const LeastSquaresOptions& options, size_t keep) {
  const Eigen::MatrixXd sets = all_combinations(parameters);
  std::vector<std::pair<double, Eigen::Index>> costs;
  double least = std::numeric_limits<double>::infinity();
  constexpr Eigen::Index kAtOnce = 8;
  const std::string name = options.journal ? options.journal->next("grid") : "";
  for (Eigen::Index first = 0; first < sets.cols(); first += kAtOnce) {
    const Eigen::Index count = std::min(kAtOnce, sets.cols() - first);
    const std::vector<double> some = costs_of(objective, parameters, sets.middleCols(first, count), options,
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
  CoarseResult out{{}, least, static_cast<int>(sets.cols())};
  for (size_t i = 0; i < std::min(keep, costs.size()); ++i) out.best.emplace_back(sets.col(costs[i].second));
  if (out.best.empty()) out.best.emplace_back(sets.col(0));
  return out;
}

}  // namespace selvedge::fit
