#include "fit/on_grids.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "cloth/spline/chosen_grid.h"
#include "fit/stages.h"
#include "model/excerpts.h"
#include "model/trial_error.h"

namespace selvedge::fit {

using Eigen::VectorXd;

namespace {

// What a finer grid does to all residuals at a fit's end.
struct GridChange {
  std::vector<VectorXd> adds_mm;                         // a trial; zero where it goes into other folds
  double mm = std::numeric_limits<double>::quiet_NaN();  // root mean square of all; NaN: a simulation diverged
  std::vector<std::string> remarks;
};

GridChange change_on_finer(const FitOutcome& out, const std::vector<model::Parameter>& parameters,
                           const estimate::LeastSquaresResult& fit, int finer_cells, const FitOptions& options) {
  constexpr double kOtherFolds_mm = 3;
  const std::vector<model::ObservedTrial>& trials = out.simulation->trials();
  const model::Simulation finer(trials, on_grid_of(finer_cells, options));
  model::State on_finer = finer.state_of(*out.simulation, out.state);
  finer.rematch(on_finer, parameters, fit.coordinates);
  const model::Residuals there = finer.evaluate(on_finer, parameters, fit.coordinates).front();
  GridChange change;
  if (!there.finite || !fit.residuals.finite) {
    change.remarks = {"what a finer grid would add is not known: a simulation on it diverged"};
    return change;
  }
  double sum = 0, count = 0;
  for (size_t i = 0; i < trials.size(); ++i) {
    VectorXd adds = there.mm[i] - fit.residuals.mm[i];
    if (!out.state.grid_correction_mm.empty()) adds += out.state.grid_correction_mm[i];
    const double mm = model::rms_mm(trials[i], adds, out.simulation->time_s(i));
    sum += mm * mm * static_cast<double>(adds.size());
    count += static_cast<double>(adds.size());
    if (mm > kOtherFolds_mm) {
      change.remarks.push_back(
          fmt::format("{}: a grid of {} cells moves the fabric by {:.1f} mm, into other folds; that is left open",
                      trials[i].name, finer_cells, mm));
      adds.setZero();
    }
    change.adds_mm.push_back(std::move(adds));
  }
  change.mm = std::sqrt(sum / std::max(count, 1.0));
  return change;
}

// Fits once more with what a finer grid adds. That changes with the parameters: it is found where they were, and again
// where it led them, until that is hardly further.
void fit_with_finer(FitOutcome& out, const std::vector<model::Parameter>& parameters, int finer_cells,
                    estimate::LeastSquaresOptions search, const FitOptions& options, GridChange& change,
                    LastStage& done) {
  constexpr int kMostRounds = 6;
  constexpr double kHardly = 0.05;  // of the cost
  const auto at_round = [](int k) { return 0.75 + 0.05 * k / kMostRounds; };
  search.steps_between = 0;
  search.max_iterations = 2;
  for (int round = 0; round < kMostRounds; ++round) {
    if (round > 0) change = change_on_finer(out, parameters, done.fit, finer_cells, options);
    out.state.grid_correction_mm = change.adds_mm;
    search.progress = part_of(options.progress, at_round(round), at_round(round + 1), "what a finer grid adds");
    done.fit = minimise(*out.simulation, out.state, parameters, done.fit.coordinates, search);
    done.evaluations += done.fit.evaluations + std::min(round, 1);
    if (round > 0 && done.fit.cost > (1 - kHardly) * done.fit.history.front()) break;
  }
}

}  // namespace

model::SimulationOptions on_grid_of(int cells, const FitOptions& options) {
  model::SimulationOptions o;
  o.cells = cells;
  o.ranks = options.ranks;
  o.simulator = options.simulator;
  return o;
}

LastStage fit_on_grids(FitOutcome& out, const std::vector<model::ObservedTrial>& trials,
                       const std::vector<model::Parameter>& parameters, VectorXd at, int cells,
                       estimate::LeastSquaresOptions search, const FitOptions& options) {
  LastStage done;
  GridChange change;
  // The end need not be exact here: it is fitted once more.
  const double enough = search.least_decrease;
  search.least_decrease = 5e-3;
  search.steps_between = 1;
  double from = 0.25;  // of the whole fit
  const auto moved_m = [&](int on) {
    search.progress = part_of(options.progress, from, from + 0.2, fmt::format("grid of {} cells", on));
    out.simulation = std::make_shared<model::Simulation>(trials, on_grid_of(on, options));
    out.state = out.simulation->state_at(parameters, at);
    done.fit = minimise_on_branches(*out.simulation, out.state, parameters, at, search);
    done.evaluations += done.fit.evaluations + 1;
    at = done.fit.coordinates;
    change = change_on_finer(out, parameters, done.fit, cloth::spline::next_finer(on), options);
    search.max_iterations = std::max(3, options.max_iterations / 2);
    from = from + 0.5 * (0.75 - from - 0.1);
    return 1e-3 * change.mm;
  };
  const int most = most_cells(model::motion_s(trials));
  const cloth::spline::ChosenGrid grid =
      cloth::spline::choose_grid(cells, options.cells > 0 ? options.cells : most, moved_m);
  if (options.cells == 0 && grid.leaves_open())
    out.remarks.push_back(fmt::format(
        "a grid of {} cells leaves {:.1f} mm open; a finer one would take minutes an iteration for {:.0f} s of motion",
        grid.cells, change.mm, model::motion_s(trials)));
  search.least_decrease = enough;
  out.grid_mm = change.mm;
  const bool is_twice = 2 * grid.cells <= most;
  const int finer = is_twice ? 2 * grid.cells : cloth::spline::next_finer(grid.cells);
  // One on twice the cells was not looked at yet.
  if (is_twice) change = change_on_finer(out, parameters, done.fit, finer, options);
  fit_with_finer(out, parameters, finer, search, options, change, done);
  out.remarks.insert(out.remarks.end(), change.remarks.begin(), change.remarks.end());
  // Behind the folds an order of one is left, that of the grips: the limit lies this many times as far beyond.
  done.open = (done.fit.coordinates - at) / (static_cast<double>(finer) / grid.cells - 1);
  return done;
}

}  // namespace selvedge::fit
