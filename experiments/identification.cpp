#include "experiments/identification.h"

#include <chrono>
#include <cmath>
#include <numeric>
#include <random>
#include <tuple>

#include <fmt/format.h>

#include "files/csv_table.h"
#include "fit/stages.h"

namespace selvedge::experiments {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kUsual =
    1.1;  // how far off the usual values at the start may be: one standard deviation is a factor of 3

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

std::string file_name(const FabricCase& c, const std::string& what) {
  std::string name = c.fabric.name + "-" + what;
  for (char& x : name)
    if (x == '/' || x == ' ') x = '-';
  return name;
}

// One line: what would make it another fit. The error at the start stands for the data and the mesh.
std::string identity_of(const FabricCase& c, const std::vector<size_t>& trials, Index searched, const VectorXd& start,
                        const IdentificationOptions& options) {
  std::string text = fmt::format("{} of {} {} evaluations {} iterations {} seed {} parameters {} trials",
                                 options.optimiser, c.fabric.name, c.error == ErrorKind::folds ? "folds" : "residuals",
                                 options.evaluations, options.iterations, options.seed, searched);
  for (const size_t t : trials) text += " " + c.campaign.trials[t].name;
  text += " start";
  for (const double x : start) {
    text += ' ';
    files::append_number(text, x);
  }
  text += " error ";
  files::append_number(text, errors(c, start, trials).sum());
  return text;
}

OneFit search_trials(const FabricCase& c, const std::vector<size_t>& trials, Index searched, const VectorXd& start,
                     const std::string& name, const IdentificationOptions& options, const KeptFits& kept) {
  const std::string identity = identity_of(c, trials, searched, start, options);
  return kept.get(name, identity, [&] {
    const auto begin = std::chrono::steady_clock::now();
    const std::vector<model::Parameter> some(c.parameters.begin(), c.parameters.begin() + searched);
    estimate::SearchProblem problem;
    std::tie(problem.lower, problem.upper) = model::bounds_of(some);
    problem.start = start.head(searched).cwiseMax(problem.lower).cwiseMin(problem.upper);
    problem.costs = costs_of_first(c, trials, searched, start);
    estimate::SearchLimits limits;
    limits.evaluations = options.evaluations;
    limits.seed = options.seed;
    limits.progress = options.progress;
    OneFit out;
    const estimate::SearchResult found =
        kept.search(name, identity, options.optimiser, std::move(problem), limits, out.from_journal);
    out.set = start;
    out.set.head(searched) = found.point;
    out.evaluations = found.evaluations;
    out.trace = found.trace;
    out.wall_s = seconds_since(begin);
    return out;
  });
}

// The same scenes, with equilibria that are sought to 10 um.
model::Simulation scenes_for_squares(const FabricCase& c) {
  model::SimulationOptions on_grid = c.fitted.scenes->options();
  on_grid.sheet.rest_change_m = 1e-5;
  return {c.observed, on_grid};
}

OneFit fit_together(const FabricCase& c, const std::vector<size_t>& trials, Index searched, const std::string& name,
                    const IdentificationOptions& options, const KeptFits& kept) {
  return kept.get(name, identity_of(c, trials, searched, c.start, options), [&] {
    const auto begin = std::chrono::steady_clock::now();
    std::vector<Index> rows(static_cast<size_t>(searched));
    std::iota(rows.begin(), rows.end(), Index{0});
    const std::vector<model::Parameter> some =
        model::only(c.parameters, rows, c.start);  // what is not searched stays at the start
    const model::Simulation scenes = scenes_for_squares(c);
    model::State state = scenes.state_of(*c.fitted.scenes, c.fitted.state);
    estimate::LeastSquaresOptions squares;
    squares.trials = trials;
    squares.max_iterations = options.iterations;
    squares.prior_sd = kUsual;
    squares.prior_centre = c.start.head(searched);
    squares.prior_as_evidence = true;
    squares.least_decrease = 2e-3;  // the error of folds does not fall by what comes after
    squares.progress = fit::part_of(options.progress, 0, 0.4, "beginnings");
    const fit::Start near = fit::fit_beginnings(scenes, state, some, c.start.head(searched), squares, {0.25, 0.5});
    squares.progress = fit::part_of(options.progress, 0.4, 1, "all frames");
    const fit::Rivals found = fit::minimise_and_return(scenes, state, some, near.coordinates, squares);
    OneFit out;
    out.set = c.start;
    out.set.head(searched) = found.best.coordinates;
    const VectorXd variance =
        found.best.covariance.diagonal().cwiseMax(found.best.covariance_between_trials.diagonal()).cwiseMax(0.0);
    const VectorXd apart = found.rival ? VectorXd(*found.rival - found.best.coordinates) : VectorXd::Zero(searched);
    out.sd = (variance + apart.cwiseAbs2()).cwiseSqrt();
    out.evaluations = near.evaluations + found.best.evaluations;
    out.wall_s = seconds_since(begin);
    return out;
  });
}

}  // namespace

double Identification::wall_s() const {
  double sum = 0;
  for (const OneFit& f : fits) sum += f.wall_s;
  return sum;
}

Identification identify(const FabricCase& c, const std::vector<size_t>& trials, Index searched,
                        const IdentificationOptions& options, const KeptFits& kept) {
  Identification out;
  out.optimiser = options.optimiser;
  if (options.optimiser == "least_squares") {
    out.labels = {"together"};
    out.fits = {fit_together(c, trials, searched, file_name(c, "least_squares"), options, kept)};
  } else {
    for (size_t k = 0; k < trials.size(); ++k) {
      IdentificationOptions one = options;
      one.progress = fit::part_of(options.progress, static_cast<double>(k) / static_cast<double>(trials.size()),
                                  static_cast<double>(k + 1) / static_cast<double>(trials.size()),
                                  c.campaign.trials[trials[k]].name);
      out.labels.push_back(fmt::format("exp {}", k + 1));
      out.fits.push_back(search_trials(c, {trials[k]}, searched, c.start,
                                       file_name(c, options.optimiser + "-" + c.campaign.trials[trials[k]].name), one,
                                       kept));
    }
  }
  MatrixXd sets(c.start.size(), static_cast<Index>(out.fits.size()) + 1);
  sets.col(0) = c.start;
  for (size_t k = 0; k < out.fits.size(); ++k) sets.col(static_cast<Index>(k) + 1) = out.fits[k].set;
  out.error = errors(c, sets, trials);
  for (size_t k = 1; k < out.fits.size(); ++k)
    if (out.error.row(static_cast<Index>(k) + 1).sum() < out.chosen_error()) out.chosen = k;
  const std::vector<model::Parameter> some(c.parameters.begin(), c.parameters.begin() + searched);
  out.variability =
      fit::variability_percent(costs_of_first(c, trials, searched, out.set()), some, out.set().head(searched));
  return out;
}

Repeats repeat(const FabricCase& c, size_t trial, Index searched, int times, const IdentificationOptions& options,
               const KeptFits& kept) {
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> within(-0.05, 0.05);
  Repeats out;
  for (int i = 0; i < times; ++i) {
    VectorXd start = c.start;
    for (Index k = 0; k < searched; ++k) start(k) += std::log1p(within(random));
    IdentificationOptions one = options;
    one.seed = options.seed + static_cast<unsigned>(i);
    one.progress = fit::part_of(options.progress, static_cast<double>(i) / times, static_cast<double>(i + 1) / times,
                                fmt::format("optimisation {}", i + 1));
    out.fits.push_back(
        search_trials(c, {trial}, searched, start, file_name(c, fmt::format("repeat-{}", i + 1)), one, kept));
    out.error.push_back(errors(c, out.fits.back().set, {trial})(0, 0));
  }
  return out;
}

}  // namespace selvedge::experiments
