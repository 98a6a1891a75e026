#include "fit/campaign_search.h"

#include <algorithm>
#include <tuple>

#include <fmt/format.h>

#include "files/bad_input.h"
#include "files/csv_table.h"
#include "fit/fit_campaign.h"
#include "fit/fold_objective.h"
#include "estimate/optimisers/registry.h"
#include "estimate/optimisers/journal.h"
#include "estimate/spread_costs.h"

namespace selvedge::fit {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Where in the list of all parameters the searched ones stand.
std::vector<Index> searched_rows(const std::vector<model::Parameter>& all, const std::vector<std::string>& names) {
  std::vector<Index> rows;
  std::string known;
  for (size_t k = 0; k < all.size(); ++k) {
    known += (k > 0 ? ", " : "") + all[k].name;
    if (names.empty() || std::find(names.begin(), names.end(), all[k].name) != names.end())
      rows.push_back(static_cast<Index>(k));
  }
  for (const std::string& name : names)
    if (place_of(all, name) == all.size())
      refuse("parameters", "found {}, expected some of {}", in_quotes(name), known);
  return rows;
}

// The whole parameter set of each point of the searched ones.
MatrixXd filled_in(const MatrixXd& points, const VectorXd& start, const std::vector<Index>& rows) {
  MatrixXd sets = start.replicate(1, points.cols());
  for (size_t k = 0; k < rows.size(); ++k) sets.row(rows[k]) = points.row(static_cast<Index>(k));
  return sets;
}

// E of all trials up to the time that is fitted.
struct FoldCosts {
  std::vector<FoldTrack> tracks;
  std::unique_ptr<FoldObjective> objective;
};

std::shared_ptr<FoldCosts> fold_costs(const model::Simulation& scenes, const model::State& state,
                                      const trial::Campaign& campaign, double until_s) {
  auto out = std::make_shared<FoldCosts>();
  for (size_t i = 0; i < campaign.trials.size(); ++i) {
    const bool still = scenes.trials()[i].still;
    FoldTrack track = track_folds(campaign.trials[i], {}, still);
    while (!still && track.time_s.size() > 1 && track.time_s.back() > until_s) {
      track.time_s.pop_back();
      track.recorded.pop_back();
    }
    out->tracks.push_back(std::move(track));
  }
  out->objective = std::make_unique<FoldObjective>(scenes, state, out->tracks);
  return out;
}

// One line: what would make the evaluations of another search other ones. The cost at the start stands for the data.
std::string identity_of(const CampaignSearch& search, const trial::Campaign& campaign,
                        const model::Simulation& objective, const VectorXd& start,
                        const std::vector<model::Parameter>& parameters, const std::vector<Index>& rows,
                        double start_cost) {
  std::string text = fmt::format("{} of {} cells {} seed {} evaluations {} parameters", search.optimiser,
                                 search.error == SearchError::folds ? "folds" : "residuals", objective.options().cells,
                                 search.seed, search.evaluations);
  for (const Index row : rows) text += " " + parameters[static_cast<size_t>(row)].name;
  text += " trials";
  for (const trial::Trial& t : campaign.trials) text += " " + t.name;
  text += " start";
  for (const double x : start) {
    text += ' ';
    files::append_number(text, x);
  }
  text += " cost ";
  files::append_number(text, start_cost);
  return text;
}

estimate::SearchResult run_search(const CampaignSearch& search, const trial::Campaign& campaign,
                                  const std::filesystem::path& folder, const model::Simulation& objective,
                                  const model::State& state, const std::vector<model::Parameter>& parameters,
                                  const VectorXd& start, const estimate::LeastSquaresOptions& options) {
  const std::vector<Index> rows = searched_rows(parameters, search.parameters);
  std::vector<model::Parameter> searched;
  for (const Index row : rows) searched.push_back(parameters[static_cast<size_t>(row)]);

  std::shared_ptr<FoldCosts> folds;
  estimate::BatchCosts costs;
  if (search.error == SearchError::folds) {
    folds = fold_costs(objective, state, campaign, options.fit_until_s);
    costs = [&](const MatrixXd& sets) {
      const VectorXd sum = folds->objective->energy(parameters, sets).rowwise().sum();
      return std::vector<double>(sum.begin(), sum.end());
    };
  } else {
    costs = [&](const MatrixXd& sets) { return costs_of(objective, state, parameters, sets, options); };
  }
  const std::shared_ptr<model::Ranks>& ranks = objective.options().ranks;
  const std::string identity = identity_of(search, campaign, objective, start, parameters, rows, costs(start).front());
  // The first rank alone writes.
  std::unique_ptr<estimate::Journal> journal;
  if (!ranks || ranks->is_first()) journal = std::make_unique<estimate::Journal>(folder / "evaluations.txt", identity);

  estimate::SearchProblem problem;
  std::tie(problem.lower, problem.upper) = bounds_of(searched);
  problem.start = VectorXd(start(rows)).cwiseMax(problem.lower).cwiseMin(problem.upper);
  problem.costs = estimate::spread_costs(
      ranks, [&](const MatrixXd& points) { return costs(filled_in(points, start, rows)); },
      [&](estimate::BatchCosts shared) { return journal->recorded(std::move(shared)); });

  estimate::SearchLimits limits;
  limits.evaluations = search.evaluations;
  limits.seed = search.seed;
  const std::string resumed =
      journal && journal->found() > 0 ? fmt::format(", {} from the journal", journal->found()) : "";
  limits.progress = [&](double done, const std::string& what) { options.progress(done, what + resumed); };
  estimate::SearchResult found = estimate::optimiser_named(search.optimiser).run(problem, limits);
  found.point = filled_in(found.point, start, rows);
  return found;
}

}  // namespace

FitOptions with_search(FitOptions options, const CampaignSearch& search, const trial::Campaign& campaign,
                       const std::filesystem::path& folder) {
  estimate::optimiser_named(search.optimiser);
  searched_rows(fitted_parameters(options), search.parameters);
  if (search.evaluations < 1) refuse("evaluations", "found {}, expected at least 1", search.evaluations);
  if (search.error == SearchError::folds)
    for (const trial::Trial& t : campaign.trials)
      if (!t.frames)
        refuse((t.folder / "trial.json").string(),
               "found no frames, expected images: the fold metric compares pictures");
  options.search = [search, &campaign, folder](const model::Simulation& objective, const model::State& state,
                                               const std::vector<model::Parameter>& parameters, const VectorXd& start,
                                               const estimate::LeastSquaresOptions& cost) {
    return run_search(search, campaign, folder, objective, state, parameters, start, cost);
  };
  return options;
}

}  // namespace selvedge::fit
