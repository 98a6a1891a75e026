#include "fit/fit_campaign.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "capture/trial/doubts.h"
#include "estimate/journal.h"
#include "estimate/kept_input.h"
#include "files/bad_input.h"
#include "fit/determined.h"
#include "fit/on_grids.h"
#include "fit/stages.h"
#include "fit/tested_parameters.h"
#include "fit/trial_errors.h"
#include "model/excerpts.h"
#include "model/held_markers.h"
#include "model/trial_error.h"

namespace selvedge::fit {

namespace {

using Eigen::VectorXd;

std::vector<size_t> moving(const std::vector<model::ObservedTrial>& trials) {
  std::vector<size_t> out;
  for (size_t i = 0; i < trials.size(); ++i)
    if (!trials[i].still) out.push_back(i);
  return out;
}

// One line: what would make it another fit.
std::string identity_of(const FitOptions& o, const std::string& recordings) {
  const std::string like = o.like ? fmt::format(" like {} {:.9g}", o.like->name, mean_bend(*o.like)) : "";
  const std::string settings =
      fmt::format("{} drag {} cells {} after {} rates {} {} motion {} iterations {} hold-out {}",
                  o.search ? "start of a search" : "least_squares", static_cast<int>(o.drag), o.cells, o.coarse_cells,
                  o.rate_hz, o.image_rate_hz, o.most_motion_s, o.max_iterations, static_cast<int>(o.hold_out)) +
      like + (o.simulator ? " simulator " + o.simulator->identity() : "");
  return settings + " input " + estimate::input_hash(recordings, settings);
}

estimate::LeastSquaresOptions search_options(const FitOptions& options, double cut_s,
                                             const report::ProgressCallback& progress,
                                             const std::shared_ptr<estimate::FitJournal>& journal) {
  estimate::LeastSquaresOptions out;
  out.journal = journal;
  out.max_iterations = options.max_iterations;
  out.fit_until_s = cut_s;
  out.progress = progress;
  return out;
}

// Two folds of whole trials: each half is predicted by what the other half gives.
void hold_out_trials(FitOutcome& out, const std::vector<model::Parameter>& parameters, const VectorXd& coordinates,
                     const FitOptions& options, const std::shared_ptr<estimate::FitJournal>& journal) {
  const size_t count = out.simulation->trials().size();
  std::vector<size_t> fold[2];
  size_t moved = 0, rested = 0;
  for (size_t i = 0; i < count; ++i) fold[(out.simulation->trials()[i].still ? rested++ : moved++) % 2].push_back(i);
  for (int side = 0; side < 2; ++side) {
    if (fold[side].empty() || fold[1 - side].empty()) continue;
    estimate::LeastSquaresOptions o = search_options(
        options, 1e300, part_of(options.progress, 0.8 + 0.1 * side, 0.9 + 0.1 * side, "held-out fold"), journal);
    o.trials = fold[side];
    o.max_iterations = 3;
    model::State state = out.state;
    const estimate::LeastSquaresResult fitted = minimise(*out.simulation, state, parameters, coordinates, o);
    const model::Residuals predicted =
        out.simulation->evaluate(state, parameters, fitted.coordinates, fold[1 - side]).front();
    out.evaluations += fitted.evaluations + 1;
    for (const size_t trial : fold[1 - side]) {
      const model::ObservedTrial& seen = out.simulation->trials()[trial];
      out.trials[trial].held_out_mm = model::rms_mm(seen, predicted.mm[trial], out.simulation->time_s(trial));
      out.trials[trial].held_out_interval_mm =
          model::rms_interval_mm(seen, predicted.mm[trial], out.simulation->time_s(trial));
      out.trials[trial].held_out_in_noise =
          model::rms_in_noise(seen, predicted.mm[trial], out.simulation->time_s(trial));
    }
  }
}

// One that diverges at its usual values would leave nothing to fit.
void expect_it_runs(const std::vector<model::ObservedTrial>& trials, const std::vector<model::Parameter>& parameters,
                    int cells, const FitOptions& options) {
  const model::Simulation one({trials.front()}, on_grid_of(cells, options));
  const VectorXd usual = usual_coordinates(parameters);
  if (!one.evaluate(one.state_at(parameters, usual), parameters, usual).front().finite)
    refuse(options.simulator->name(), "{} diverges at its default values: {}; expected positions", trials.front().name,
           options.simulator->last_divergence());
}

TestedParameters begun_parameters(const trial::Campaign& campaign, const FitOptions& options) {
  if (options.simulator) {
    TestedParameters own{fitted_parameters(options), {}, {}};
    if (!trial::only_tests(campaign, true).trials.empty())
      own.remarks.push_back("the campaign's material tests are left out: parameters are the simulator's own");
    return own;
  }
  TestedParameters tested = tested_parameters(campaign, options.drag);
  if (options.like) begin_like(*options.like, tested);
  return tested;
}

// No parameter of a fabric stands for markers that are stamped late: where those on held points come clearly after the
// grips' path, the path is moved there.
void put_clocks_together(FitOutcome& out, std::vector<model::ObservedTrial>& trials) {
  constexpr double kMost_s = 0.5, kLeast_s = 0.02, kDeviations = 3;
  const std::optional<model::HeldDelay> delay = model::held_delay(trials, kMost_s);
  if (!delay || std::abs(delay->delay_s) < std::max(kLeast_s, kDeviations * delay->sd_s)) return;
  for (model::ObservedTrial& trial : trials)
    if (trial.markers)
      for (double& t : trial.experiment.path.time_s) t += delay->delay_s;
  out.delay = delay;
  out.remarks.push_back(in_words(*delay) + "; the fit moves the path by as much");
}

// What is fitted of a campaign that moves for long: its most moved pieces, which other trials then predict.
void take_excerpts(FitOutcome& out, std::vector<model::ObservedTrial>& trials, const FitOptions& options) {
  if (options.most_motion_s <= 0 || moving(trials).size() < 2) return;
  const double all_s = model::motion_s(trials);
  trials = model::without_leads(model::excerpts(std::move(trials), {.most_motion_s = options.most_motion_s}));
  const double taken_s = model::motion_s(trials);
  if (taken_s < all_s)
    out.remarks.push_back(fmt::format(
        "of {:.0f} s of motion the {:.0f} s in which the held points move most are fitted", all_s, taken_s));
}

const char* drag_text(model::Drag drag) {
  return drag == model::Drag::nonlinear ? "nonlinear drag" : drag == model::Drag::linear ? "linear drag" : "no drag";
}

// What is fitted of the campaign, with what of it is held out.
std::vector<model::ObservedTrial> observed_trials(FitOutcome& out, const trial::Campaign& campaign,
                                                  const FitOptions& options) {
  const trial::Campaign rig = trial::only_tests(campaign, false);
  if (rig.trials.empty())
    refuse(campaign.folder.string(), "found material tests alone, expected a fabric that hangs from a rig");
  out.doubts = trial::doubts(rig);
  std::vector<model::ObservedTrial> trials =
      observe_campaign(rig, options.rate_hz, options.image_rate_hz, part_of(options.progress, 0, 0.05, "campaign"));
  for (model::ObservedTrial& trial : trials) trial.experiment.stop = options.stop;
  put_clocks_together(out, trials);
  const bool by_trials =
      options.hold_out == HoldOut::trials || (options.hold_out == HoldOut::automatic && moving(trials).size() >= 4);
  const bool of_none = options.hold_out == HoldOut::none;
  if (by_trials || of_none) take_excerpts(out, trials, options);
  out.hold_out = of_none ? "none" : by_trials ? "trials" : "frames";
  const std::vector<size_t> moved = moving(trials);
  out.cut_s = of_none || by_trials || moved.empty()
                  ? 1e300
                  : trials[moved.front()].experiment.start_s + 2.0 / 3 * last_observed_s(trials);
  return trials;
}

// Of another simulator's grid, where none is asked for.
int cells_of_other(const FitOptions& options) {
  constexpr int kCells = 16;
  return options.cells > 0 ? options.cells : kCells;
}

Start found_start(const FitOutcome& out, const std::vector<model::ObservedTrial>& trials,
                  const std::vector<model::Parameter>& parameters, const FitOptions& options,
                  const std::shared_ptr<estimate::FitJournal>& journal) {
  const int others = cells_of_other(options);
  if (options.simulator) expect_it_runs(trials, parameters, others, options);
  return find_start(trials, on_grid_of(options.simulator ? others : options.coarse_cells, options),
                    options.simulator   ? others
                    : options.cells > 0 ? options.coarse_cells
                                        : std::min(kMostCellsAtFirst, most_cells(model::motion_s(trials))),
                    parameters,
                    search_options(options, out.cut_s, part_of(options.progress, 0.05, 0.25, "coarse grid"), journal));
}

int cells_of_last(const std::vector<model::ObservedTrial>& trials, const std::vector<model::Parameter>& parameters,
                  const VectorXd& at, const FitOptions& options) {
  if (options.simulator) return cells_of_other(options);
  if (options.cells > 0) return options.cells;
  return std::clamp(model::cells_of_bending_length(trials.front(), parameters, at), options.coarse_cells,
                    most_cells(model::motion_s(trials)));
}

// A search in the place of least squares, and derivatives where it ends.
estimate::LeastSquaresResult fit_by_search(FitOutcome& out, const std::vector<model::Parameter>& parameters,
                                           const VectorXd& at, estimate::LeastSquaresOptions last,
                                           const FitOptions& options, int& evaluations) {
  const estimate::SearchResult searched =
      options.search(*out.simulation, out.state, parameters, at,
                     search_options(options, out.cut_s, part_of(options.progress, 0.25, 0.75, "search"), nullptr));
  out.trace = searched.trace;
  evaluations += searched.evaluations;
  last.max_iterations = 0;  // derivatives alone
  last.progress = part_of(options.progress, 0.75, 0.8, "derivatives");
  return minimise(*out.simulation, out.state, parameters, searched.point, last);
}

LastStage fit_last(FitOutcome& out, const std::vector<model::ObservedTrial>& trials,
                   const std::vector<model::Parameter>& parameters, const Start& found, const FitOptions& options,
                   const std::shared_ptr<estimate::FitJournal>& journal) {
  const VectorXd& at = found.coordinates;
  const int cells = cells_of_last(trials, parameters, at, options);
  estimate::LeastSquaresOptions last = search_options(options, out.cut_s, options.progress, journal);
  if (!options.search && !options.simulator) return fit_on_grids(out, trials, parameters, at, cells, last, options);
  out.grid_mm = std::numeric_limits<double>::quiet_NaN();
  out.simulation = std::make_shared<model::Simulation>(trials, on_grid_of(cells, options));
  out.state = out.simulation->state_at(parameters, at);
  LastStage done{{}, VectorXd::Zero(at.size()), 0};
  if (options.search) {
    done.fit = fit_by_search(out, parameters, at, last, options, done.evaluations);
  } else {
    // Another simulator's grid is its own: there is none finer to look at.
    last.progress = part_of(options.progress, 0.25, 0.8, options.simulator->name());
    done.fit = minimise_on_branches(*out.simulation, out.state, parameters, at, last);
  }
  done.evaluations += done.fit.evaluations;
  return done;
}

}  // namespace

std::string input_of(const std::string& recordings, model::Drag drag) {
  return estimate::input_hash(recordings, std::string("fit with ") + model::to_text(drag));
}

std::string input_of(const std::string& recordings, const model::Simulator& simulator) {
  return estimate::input_hash(recordings, "fit with " + simulator.identity());
}

HoldOut hold_out_named(const std::string& word) {
  static const std::pair<const char*, HoldOut> all[] = {{"automatic", HoldOut::automatic},
                                                        {"frames", HoldOut::frames},
                                                        {"trials", HoldOut::trials},
                                                        {"none", HoldOut::none}};
  for (const auto& [name, hold_out] : all)
    if (word == name) return hold_out;
  refuse("hold_out", "found {}, expected automatic, frames, trials or none", in_quotes(word));
}

std::vector<model::Parameter> fitted_parameters(const FitOptions& options) {
  return options.simulator ? options.simulator->parameters() : model::base_parameters(options.drag);
}

FitOutcome fit_campaign(const trial::Campaign& campaign, const FitOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  FitOutcome out;
  out.campaign = campaign.folder.filename().string();
  const std::string recordings = estimate::recordings_hash(campaign);
  out.simulator = options.simulator;
  out.input = options.simulator ? input_of(recordings, *options.simulator) : input_of(recordings, options.drag);
  TestedParameters tested = begun_parameters(campaign, options);
  const std::vector<model::Parameter>& parameters = tested.parameters;
  out.tests = tested.tests;
  out.remarks = tested.remarks;
  const std::vector<model::ObservedTrial> trials = observed_trials(out, campaign, options);
  std::shared_ptr<estimate::FitJournal> journal;
  if (!options.journal.empty())
    journal = estimate::FitJournal::shared(options.journal, identity_of(options, recordings), options.ranks);
  const Start found = found_start(out, trials, parameters, options, journal);
  const LastStage last = fit_last(out, trials, parameters, found, options, journal);
  out.model = options.simulator ? options.simulator->name()
                                : fmt::format("Baraff-Witkin on bicubic splines, {}, {} cells along the width",
                                              drag_text(options.drag), out.simulation->options().cells);
  const estimate::LeastSquaresResult& fit = last.fit;
  out.coordinates = fit.coordinates;
  out.residuals = fit.residuals;
  out.residuals_start = out.simulation->evaluate(out.state, parameters, found.coordinates).front();
  out.history = fit.history;
  out.evaluations = found.evaluations + last.evaluations + 1;
  judge_parameters(out, parameters, found.coordinates, fit, last.open);
  name_weak_combinations(out, parameters, fit);
  find_correlation(out, fit);
  list_errors(out);
  if (out.hold_out == "trials") hold_out_trials(out, parameters, fit.coordinates, options, journal);
  out.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  options.progress(1, "done");
  return out;
}

}  // namespace selvedge::fit
