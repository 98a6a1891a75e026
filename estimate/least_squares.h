// Trust-region least squares over many trials: Levenberg–Marquardt with derivatives by finite differences.
//
// Minimises Σ ρ((r/sd)²) with Cauchy's ρ, so that samples that are centimetres off do not steer the fit, plus
// a pull (prior_sd in coordinates) towards the start, prior_centre or what was measured (Parameter::measured), that
// keeps undetermined parameters where they are; weak, or evidence like the rest. Parameter sets of one iteration run
// side by side in SIMD lanes: the differences, then four dampings at once.
#pragma once

#include <optional>

#include "model/simulation.h"
#include "report/progress.h"

namespace selvedge::estimate {

class FitJournal;

struct LeastSquaresOptions {
  int max_iterations = 12;
  int steps_between = 0;  // with an iteration's derivatives, brought up to date by Broyden's rule, before the next
  bool only_coordinates = false;                // the rest of the result is not asked for, and costs nothing
  double least_decrease = 2e-4;                 // of the cost, relative; smaller twice in a row ends the fit
  double difference = 0.03;                     // in coordinates
  std::optional<double> prior_sd;               // in coordinates; without: each parameter's own
  std::optional<Eigen::VectorXd> prior_centre;  // without: where this fit starts
  // Residuals of 0.2 s of a trial count as one, not one by one: the prior's odds are what they say.
  bool prior_as_evidence = false;
  std::vector<size_t> trials;  // fitted ones; empty: all
  double fit_until_s = 1e300;  // later residuals of moving trials are held out
  report::ProgressCallback progress = [](double, const std::string&) {};
  std::shared_ptr<FitJournal> journal;  // where set, iterations are kept there and gone on from
};

struct LeastSquaresResult {
  Eigen::VectorXd coordinates;
  double cost = 0;
  Eigen::MatrixXd information;                // JᵀWJ + prior at the end
  Eigen::MatrixXd covariance;                 // of coordinates: sandwich over blocks of trial and 0.2 s
  Eigen::MatrixXd covariance_between_trials;  // the same with whole trials as blocks: how far they pull apart
  model::Residuals residuals;                 // at the end
  double scale = 1;                           // robust standard deviation of r / sd at the end
  int evaluations = 0;                        // simulations of one parameter set over all trials
  std::vector<double> history;                // cost after each iteration
};

// state: the branches that equilibria start from; it leaves with those at the end.
LeastSquaresResult minimise(const model::Simulation& simulation, model::State& state,
                            const std::vector<model::Parameter>& parameters, const Eigen::VectorXd& start,
                            const LeastSquaresOptions& options = {});

// Cost of residuals, as minimised but without prior and with a robust scale of 1, so that several compare; infinity
// where a simulation diverged.
double cost_of(const model::Simulation& simulation, const model::Residuals& residuals,
               const LeastSquaresOptions& options);
// Of several sets of coordinates, a column each.
std::vector<double> costs_of(const model::Simulation& simulation, const model::State& state,
                             const std::vector<model::Parameter>& parameters, const Eigen::MatrixXd& sets,
                             const LeastSquaresOptions& options);

}  // namespace selvedge::estimate
