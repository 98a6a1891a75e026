#include "fit/stages.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>

#include <fmt/format.h>

#include "files/bad_input.h"
#include "fit/coarse_search.h"
#include "model/excerpts.h"
#include "observe/stripe_residual.h"

namespace selvedge::fit {

using Eigen::VectorXd;

namespace {

std::vector<size_t> first_few(const std::vector<model::ObservedTrial>& trials) {
  std::vector<size_t> few;
  size_t moved = 0;
  for (size_t i = 0; i < trials.size(); ++i)
    if (trials[i].still || moved++ < 3) few.push_back(i);
  return few;
}

double first_observed_s(const model::ObservedTrial& t) {
  double begin = std::numeric_limits<double>::infinity();
  if (t.markers) begin = std::min(begin, t.markers->time_s.front());
  if (t.stripes && !t.stripes->frames.empty()) begin = std::min(begin, t.stripes->frames.front().time_s);
  return begin;
}

double last_observed_s(const model::ObservedTrial& t) {
  double end = -std::numeric_limits<double>::infinity();
  if (t.markers) end = std::max(end, t.markers->time_s.back());
  if (t.stripes) end = std::max(end, last_time_s(*t.stripes));
  return end;
}

// The longest that a moving trial is observed, up to until_s on its clock.
double longest_span_s(const std::vector<model::ObservedTrial>& trials, double until_s) {
  double span = 0;
  for (const model::ObservedTrial& t : trials)
    if (!t.still) span = std::max(span, std::min(until_s, last_observed_s(t)) - t.experiment.start_s);
  return span;
}

// The first span_s of a trial that moves, or as much of it as shows anything; all of one that rests.
model::ObservedTrial first_of(const model::ObservedTrial& t, double span_s) {
  return model::beginning_of(t, std::max(t.experiment.start_s + span_s, first_observed_s(t)));
}

// Still trials and the beginnings of the first three that move. Enough to start from: still trials are cheap, and three
// that move show every parameter once.
std::vector<model::ObservedTrial> beginnings_of(const std::vector<model::ObservedTrial>& trials, double span_s) {
  std::vector<model::ObservedTrial> out;
  for (const size_t i : first_few(trials)) out.push_back(first_of(trials[i], span_s));
  return out;
}

// Which parameters a short piece of motion shows; the others would wander off there.
std::vector<Eigen::Index> shown_soon(const std::vector<model::Parameter>& parameters) {
  std::vector<Eigen::Index> rows;
  for (size_t k = 0; k < parameters.size(); ++k)
    if (parameters[k].shows_soon) rows.push_back(static_cast<Eigen::Index>(k));
  return rows;
}

// A set of parameters, where it was found.
struct Candidate {
  VectorXd coordinates;
  double cost = 0;
  std::shared_ptr<const model::Simulation> grid;
  model::State state;
};

// The parameters once for each rigidity that is tried, with that one alone.
std::vector<std::vector<model::Parameter>> by_rigidity(const std::vector<model::Parameter>& parameters) {
  const size_t bend = place_of(parameters, "bend");
  if (bend == parameters.size() || parameters[bend].tried.empty()) return {parameters};
  std::vector<std::vector<model::Parameter>> out;
  for (const double value : parameters[bend].tried) {
    out.push_back(parameters);
    out.back()[bend].start = value;
    out.back()[bend].tried = {value};
  }
  return out;
}

model::SimulationOptions with_cells(model::SimulationOptions on, int cells) {
  on.cells = cells;
  return on;
}

}  // namespace

std::vector<model::ObservedTrial> observe_campaign(const trial::Campaign& campaign, double rate_hz,
                                                   double image_rate_hz, const report::ProgressCallback& progress,
                                                   observe::Thinning thinning) {
  std::vector<model::ObservedTrial> trials;
  for (const trial::Trial& trial : campaign.trials) {
    observe::ObserveOptions observe;
    observe.rate_hz = trial.markers ? rate_hz : image_rate_hz;
    observe.thinning = thinning;
    trials.push_back(model::observe_trial(trial, observe));
    const trial::Fabric &a = trial.fabric, &b = campaign.trials[0].fabric;
    if (a.width_m != b.width_m || a.height_m != b.height_m)
      refuse((trial.folder / "trial.json").string(),
             "found a fabric of {} x {} m, expected that of the campaign's other trials, {} x {} m", a.width_m,
             a.height_m, b.width_m, b.height_m);
    progress(static_cast<double>(trials.size()) / static_cast<double>(campaign.trials.size()), "reading " + trial.name);
  }
  return trials;
}

double last_observed_s(const std::vector<model::ObservedTrial>& trials) {
  double end = 0;
  for (const model::ObservedTrial& t : trials)
    if (!t.still) end = std::max(end, last_observed_s(t));
  return end;
}

report::ProgressCallback part_of(const report::ProgressCallback& whole, double from, double to,
                                 const std::string& name) {
  return [=](double done, const std::string& what) { whole(from + (to - from) * done, name + ": " + what); };
}

estimate::LeastSquaresResult minimise_on_branches(const model::Simulation& simulation, model::State& state,
                                                  const std::vector<model::Parameter>& parameters,
                                                  const Eigen::VectorXd& start,
                                                  const estimate::LeastSquaresOptions& options) {
  estimate::LeastSquaresResult result = minimise(simulation, state, parameters, start, options);
  constexpr int kRounds = 2;
  for (int round = 0; round < kRounds && simulation.rematch(state, parameters, result.coordinates, options.trials);
       ++round) {
    estimate::LeastSquaresResult again = minimise(simulation, state, parameters, result.coordinates, options);
    again.evaluations += result.evaluations + 1;
    again.history.insert(again.history.begin(), result.history.begin(), result.history.end());
    result = std::move(again);
  }
  return result;
}

Start fit_beginnings(const model::Simulation& simulation, const model::State& state,
                     const std::vector<model::Parameter>& parameters, const Eigen::VectorXd& start,
                     const estimate::LeastSquaresOptions& options, const std::vector<double>& shares) {
  const std::vector<model::ObservedTrial>& whole = simulation.trials();
  const double span_s = longest_span_s(whole, options.fit_until_s);
  const std::vector<Eigen::Index> rows = shown_soon(parameters);
  const std::vector<model::Parameter> some_parameters = only(parameters, rows, start);
  Start out{start, 0};
  for (size_t i = 0; i < shares.size(); ++i) {
    std::vector<model::ObservedTrial> begun;
    for (const model::ObservedTrial& t : whole) begun.push_back(first_of(t, shares[i] * span_s));
    const model::Simulation part(std::move(begun), simulation.options());
    model::State of_part = part.state_of(simulation, state);
    estimate::LeastSquaresOptions some = options;
    some.max_iterations = std::min(6, options.max_iterations);
    if (options.prior_centre) some.prior_centre = Eigen::VectorXd((*options.prior_centre)(rows));
    const double from = static_cast<double>(i) / static_cast<double>(shares.size());
    some.progress = part_of(options.progress, from, from + 1.0 / static_cast<double>(shares.size()),
                            fmt::format("first {:.0f} %", 100 * shares[i]));
    const estimate::LeastSquaresResult fitted = minimise(part, of_part, some_parameters, out.coordinates(rows), some);
    out.coordinates(rows) = fitted.coordinates;
    out.evaluations += fitted.evaluations;
  }
  return out;
}

Rivals minimise_and_return(const model::Simulation& simulation, model::State& state,
                           const std::vector<model::Parameter>& parameters, const Eigen::VectorXd& start,
                           const estimate::LeastSquaresOptions& options) {
  constexpr double kClear = 0.05,
                   kUnclear = 0.3;  // moved by this much: what a short piece of motion shows, and the rest
  constexpr double kAlike = 1.5;    // costs up to this ratio: a valley that the trials do not rule out
  estimate::LeastSquaresOptions part = options;
  part.progress = part_of(options.progress, 0, 0.6, "down");
  estimate::LeastSquaresResult first = minimise(simulation, state, parameters, start, part);
  Eigen::VectorXd moved = Eigen::VectorXd::Constant(first.coordinates.size(), -kUnclear);
  for (const Eigen::Index row : shown_soon(parameters))
    if (parameters[static_cast<size_t>(row)].name != "bend_damping") moved(row) = kClear;
  part.progress = part_of(options.progress, 0.6, 1, "back from elsewhere");
  estimate::LeastSquaresResult second = minimise(simulation, state, parameters, first.coordinates + moved, part);
  const int evaluations = first.evaluations + second.evaluations;
  // One scale for both; the pull to either start is left out.
  const double a = cost_of(simulation, first.residuals, options), b = cost_of(simulation, second.residuals, options);
  if (b < a) std::swap(first, second);
  Rivals out{std::move(first), std::nullopt};
  out.best.evaluations = evaluations;
  if (std::max(a, b) < kAlike * std::min(a, b)) out.rival = second.coordinates;
  return out;
}

int most_cells(double motion_s) {
  constexpr int kMostCells = 64;  // a finer one is not tried
  return std::clamp(static_cast<int>(24 / std::cbrt(std::max(0.1, motion_s / 12))), 12, kMostCells);
}

Start find_start(const std::vector<model::ObservedTrial>& trials, const model::SimulationOptions& on, int most_cells,
                 const std::vector<model::Parameter>& parameters, const estimate::LeastSquaresOptions& options) {
  constexpr size_t kCandidates = 2;
  constexpr double kBeginning = 0.4, kLeast_s = 1.2;  // of the longest trial
  constexpr double kSearchShare = 0.4;                // of the work
  const double span_s = longest_span_s(trials, options.fit_until_s);
  const std::vector<model::ObservedTrial> begun =
      beginnings_of(trials, std::clamp(kBeginning * span_s, std::min(kLeast_s, span_s), span_s));
  estimate::LeastSquaresOptions search = options;
  search.max_iterations = 5;
  search.steps_between = 1;
  search.least_decrease = 2e-2;
  std::vector<Candidate> candidates;
  Start out;
  const std::vector<std::vector<model::Parameter>> rigidities = by_rigidity(parameters);
  std::map<int, std::shared_ptr<const model::Simulation>> grids;
  for (size_t k = 0; k < rigidities.size(); ++k) {
    const std::vector<model::Parameter>& with = rigidities[k];
    const VectorXd usual = usual_coordinates(with);
    const int cells = std::clamp(model::cells_of_bending_length(trials.front(), with, usual), on.cells, most_cells);
    auto& grid = grids[cells];
    if (!grid) grid = std::make_shared<const model::Simulation>(begun, with_cells(on, cells));
    const double from = kSearchShare * static_cast<double>(k) / static_cast<double>(rigidities.size());
    search.progress = part_of(options.progress, from, from + kSearchShare / static_cast<double>(rigidities.size()),
                              fmt::format("search on {} cells", cells));
    Candidate common{{}, 0, grid, grid->state_at(with, usual)};
    const CoarseResult found = coarse_search(*grid, common.state, with, search, kCandidates);
    out.evaluations += found.evaluations;
    for (size_t i = 0; i < found.best.size(); ++i) {
      common.coordinates = found.best[i];
      common.cost = found.costs[i];
      candidates.push_back(common);
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  candidates.resize(std::min(candidates.size(), kCandidates));
  out.coordinates = candidates.front().coordinates;
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < candidates.size(); ++i) {
    const double from = kSearchShare + (1 - kSearchShare) * static_cast<double>(i) / kCandidates;
    search.progress = part_of(options.progress, from, from + (1 - kSearchShare) / kCandidates,
                              fmt::format("start {} of {}", i + 1, candidates.size()));
    Candidate& c = candidates[i];
    c.grid->rematch(c.state, parameters, c.coordinates);
    const estimate::LeastSquaresResult fitted =
        minimise_on_branches(*c.grid, c.state, parameters, c.coordinates, search);
    out.evaluations += fitted.evaluations;
    // One scale for all, so that a start that fits little well does not win by calling the rest outliers.
    const double cost = cost_of(*c.grid, fitted.residuals, search);
    if (!(cost < least)) continue;
    least = cost;
    out.coordinates = fitted.coordinates;
  }
  return out;
}

}  // namespace selvedge::fit
