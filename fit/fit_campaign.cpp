#include "fit/fit_campaign.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include "capture/trial/doubts.h"
#include "estimate/journal.h"
#include "cloth/spline/chosen_grid.h"
#include "files/bad_input.h"
#include "estimate/kept_input.h"
#include "model/excerpts.h"
#include "model/held_markers.h"
#include "model/trial_error.h"
#include "fit/stages.h"
#include "fit/tested_parameters.h"
#include "observe/stripe_residual.h"
#include "report/text_table.h"

namespace selvedge::fit {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::vector<size_t> moving(const std::vector<model::ObservedTrial>& trials) {
  std::vector<size_t> out;
  for (size_t i = 0; i < trials.size(); ++i)
    if (!trials[i].still) out.push_back(i);
  return out;
}

model::SimulationOptions on_grid_of(int cells, const FitOptions& options) {
  model::SimulationOptions o;
  o.cells = cells;
  o.ranks = options.ranks;
  o.simulator = options.simulator;
  return o;
}

// Root mean square of markers' speed error, mm/s: differences of position residuals over neighbouring times.
std::optional<double> velocity_error(const model::ObservedTrial& trial, const VectorXd& residual) {
  if (!trial.markers || trial.still || trial.markers->time_s.size() < 2 || residual.size() == 0) return std::nullopt;
  const observe::MarkerTrack& m = *trial.markers;
  double sum = 0;
  size_t count = 0;
  for (size_t k = 0; k < m.uv.size(); ++k)
    for (size_t j = 0; j + 1 < m.time_s.size(); ++j) {
      const auto at = static_cast<Index>(3 * (k * m.time_s.size() + j));
      const Eigen::Vector3d v =
          (residual.segment<3>(at + 3) - residual.segment<3>(at)) / (m.time_s[j + 1] - m.time_s[j]);
      if (!v.allFinite()) continue;
      sum += v.squaredNorm();
      ++count;
    }
  if (count == 0) return std::nullopt;
  return std::sqrt(sum / static_cast<double>(count));
}

// A plate that hangs straight down from the bar between the two held points, no stretch, no swing.
std::optional<double> plate_error(const model::ObservedTrial& trial) {
  if (!trial.markers || trial.experiment.path.hold == cloth::Hold::corners) return std::nullopt;
  const observe::MarkerTrack& m = *trial.markers;
  const Eigen::Vector3d down = trial.experiment.gravity_m_s2.normalized();
  double sum = 0;
  size_t count = 0;
  for (size_t j = 0; j < m.time_s.size(); ++j) {
    const Eigen::Matrix<double, 3, 2> bar = trial.experiment.path.at(m.time_s[j]);
    for (size_t k = 0; k < m.uv.size(); ++k) {
      const Eigen::Vector3d seen = m.position.col(static_cast<Index>(k * m.time_s.size() + j));
      if (!seen.allFinite()) continue;
      const Eigen::Vector3d plate =
          bar.col(0) + m.uv[k].x() / trial.width_m * (bar.col(1) - bar.col(0)) + m.uv[k].y() * down;
      sum += (seen - plate).squaredNorm();
      ++count;
    }
  }
  return 1e3 * std::sqrt(sum / static_cast<double>(std::max<size_t>(count, 1)));
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

// Combinations that the trials cannot tell apart: eigenvectors of the information with little of it.
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

void list_errors(FitOutcome& out) {
  for (size_t i = 0; i < out.simulation->trials().size(); ++i) {
    const model::ObservedTrial& t = out.simulation->trials()[i];
    const VectorXd time = out.simulation->time_s(i);
    TrialError e;
    e.name = t.name;
    const double until = t.still ? 1e300 : out.cut_s;
    e.start_mm = model::rms_mm(t, out.residuals_start.mm[i], time, -1e300, until);
    e.end_mm = model::rms_mm(t, out.residuals.mm[i], time, -1e300, until);
    e.moving_mm = t.still ? kNaN : model::rms_mm(t, out.residuals.mm[i], time, model::first_move_s(t), until);
    e.held_out_mm = until < 1e299 ? model::rms_mm(t, out.residuals.mm[i], time, until + 1e-9) : kNaN;
    if (until < 1e299) {
      e.held_out_interval_mm = model::rms_interval_mm(t, out.residuals.mm[i], time, until + 1e-9);
      e.held_out_in_noise = model::rms_in_noise(t, out.residuals.mm[i], time, until + 1e-9);
    }
    e.velocity_start_mm_s = velocity_error(t, out.residuals_start.mm[i]);
    e.velocity_end_mm_s = velocity_error(t, out.residuals.mm[i]);
    e.rigid_plate_mm = plate_error(t);
    e.frames = t.markers ? t.markers->time_s.size() : t.stripes->frames.size();
    out.trials.push_back(std::move(e));
  }
}

// What a finer grid does to all residuals at a fit's end.
struct GridChange {
  std::vector<VectorXd> adds_mm;  // a trial; zero where it goes into other folds
  double mm = kNaN;               // root mean square of all; NaN: a simulation diverged
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

struct OnGrids {
  estimate::LeastSquaresResult fit;
  VectorXd open;  // how far the limit of ever finer grids may lie beyond, in coordinates
  int evaluations = 0;
};

// Fits once more with what a finer grid adds. That changes with the parameters: it is found where they were, and again
// where it led them, until that is hardly further.
void fit_with_finer(FitOutcome& out, const std::vector<model::Parameter>& parameters, int finer_cells,
                    estimate::LeastSquaresOptions search, const FitOptions& options, GridChange& change,
                    OnGrids& done) {
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

// Fits on a grid, from `at`, and on finer ones while the next finer one moves the fabric further than it may; then once
// more with what that one adds.
OnGrids fit_on_grids(FitOutcome& out, const std::vector<model::ObservedTrial>& trials,
                     const std::vector<model::Parameter>& parameters, VectorXd at, int cells,
                     estimate::LeastSquaresOptions search, const FitOptions& options) {
  OnGrids done;
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

// Another simulator's grid is its own: there is none finer to look at.
estimate::LeastSquaresResult fit_as_it_is(FitOutcome& out, const std::vector<model::ObservedTrial>& trials,
                                          const std::vector<model::Parameter>& parameters, const VectorXd& at,
                                          int cells, estimate::LeastSquaresOptions search, const FitOptions& options) {
  search.progress = part_of(options.progress, 0.25, 0.8, options.simulator->name());
  out.simulation = std::make_shared<model::Simulation>(trials, on_grid_of(cells, options));
  out.state = out.simulation->state_at(parameters, at);
  return minimise_on_branches(*out.simulation, out.state, parameters, at, search);
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
  const trial::Campaign rig = trial::only_tests(campaign, false);
  if (rig.trials.empty())
    refuse(campaign.folder.string(), "found material tests alone, expected a fabric that hangs from a rig");
  out.doubts = trial::doubts(rig);
  std::vector<model::ObservedTrial> observed =
      observe_campaign(rig, options.rate_hz, options.image_rate_hz, part_of(options.progress, 0, 0.05, "campaign"));
  for (model::ObservedTrial& trial : observed) trial.experiment.stop = options.stop;
  put_clocks_together(out, observed);
  const bool by_trials =
      options.hold_out == HoldOut::trials || (options.hold_out == HoldOut::automatic && moving(observed).size() >= 4);
  const bool of_none = options.hold_out == HoldOut::none;
  if (by_trials || of_none) take_excerpts(out, observed, options);
  const std::vector<model::ObservedTrial>& trials = observed;
  out.hold_out = of_none ? "none" : by_trials ? "trials" : "frames";
  out.cut_s = of_none || by_trials || moving(trials).empty()
                  ? 1e300
                  : trials[moving(trials).front()].experiment.start_s + 2.0 / 3 * last_observed_s(trials);

  std::shared_ptr<estimate::FitJournal> journal;
  if (!options.journal.empty())
    journal = estimate::FitJournal::shared(options.journal, identity_of(options, recordings), options.ranks);

  constexpr int kCellsOfOthers = 16;
  const int others = options.cells > 0 ? options.cells : kCellsOfOthers;
  if (options.simulator) expect_it_runs(trials, parameters, others, options);
  const Start found = find_start(
      trials, on_grid_of(options.simulator ? others : options.coarse_cells, options),
      options.simulator   ? others
      : options.cells > 0 ? options.coarse_cells
                          : std::min(kMostCellsAtFirst, most_cells(model::motion_s(trials))),
      parameters, search_options(options, out.cut_s, part_of(options.progress, 0.05, 0.25, "coarse grid"), journal));
  const int cells = options.simulator ? others
                    : options.cells > 0
                        ? options.cells
                        : std::clamp(model::cells_of_bending_length(trials.front(), parameters, found.coordinates),
                                     options.coarse_cells, most_cells(model::motion_s(trials)));
  estimate::LeastSquaresOptions last = search_options(options, out.cut_s, options.progress, journal);
  estimate::LeastSquaresResult fit;
  VectorXd mesh = VectorXd::Zero(found.coordinates.size());
  int before_last = found.evaluations;
  out.grid_mm = kNaN;
  if (options.search) {
    out.simulation = std::make_shared<model::Simulation>(trials, on_grid_of(cells, options));
    out.state = out.simulation->state_at(parameters, found.coordinates);
    const estimate::SearchResult searched =
        options.search(*out.simulation, out.state, parameters, found.coordinates,
                       search_options(options, out.cut_s, part_of(options.progress, 0.25, 0.75, "search"), nullptr));
    out.trace = searched.trace;
    before_last += searched.evaluations;
    last.max_iterations = 0;  // derivatives alone
    last.progress = part_of(options.progress, 0.75, 0.8, "derivatives");
    fit = minimise(*out.simulation, out.state, parameters, searched.point, last);
  } else if (options.simulator) {
    fit = fit_as_it_is(out, trials, parameters, found.coordinates, cells, last, options);
  } else {
    OnGrids done = fit_on_grids(out, trials, parameters, found.coordinates, cells, last, options);
    before_last += done.evaluations - done.fit.evaluations;
    fit = std::move(done.fit);
    mesh = std::move(done.open);
  }

  out.model = options.simulator ? options.simulator->name()
                                : fmt::format("Baraff-Witkin on bicubic splines, {}, {} cells along the width",
                                              drag_text(options.drag), out.simulation->options().cells);
  out.coordinates = fit.coordinates;
  out.residuals = fit.residuals;
  out.residuals_start = out.simulation->evaluate(out.state, parameters, found.coordinates).front();
  out.history = fit.history;
  out.evaluations = before_last + fit.evaluations + 1;
  judge_parameters(out, parameters, found.coordinates, fit, mesh);
  name_weak_combinations(out, parameters, fit);
  find_correlation(out, fit);
  list_errors(out);
  if (by_trials) hold_out_trials(out, parameters, fit.coordinates, options, journal);
  out.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  options.progress(1, "done");
  return out;
}

namespace {

template <class Get>
std::optional<double> pooled(const FitOutcome& outcome, const Get& get) {
  double sum = 0, count = 0;
  for (const TrialError& t : outcome.trials) {
    const std::optional<double> value = get(t);
    if (!value || !std::isfinite(*value)) continue;
    sum += *value * *value * static_cast<double>(t.frames);
    count += static_cast<double>(t.frames);
  }
  return count > 0 ? std::optional<double>(std::sqrt(sum / count)) : std::nullopt;
}

}  // namespace

double held_out_mm(const FitOutcome& outcome) {
  return pooled(outcome, [](const TrialError& t) { return std::optional<double>(t.held_out_mm); }).value_or(kNaN);
}

double fitted_mm(const FitOutcome& outcome) {
  const auto fitted = [](const TrialError& t) {
    const double mm = std::isfinite(t.moving_mm) ? t.moving_mm : t.end_mm;
    return std::isfinite(t.held_out_mm) ? std::optional<double>(mm) : std::nullopt;
  };
  return pooled(outcome, fitted).value_or(kNaN);
}

std::optional<double> rigid_plate_mm(const FitOutcome& outcome) {
  return pooled(outcome, [](const TrialError& t) { return t.rigid_plate_mm; });
}

}  // namespace selvedge::fit
