#include "cli/proofs/fabric_case.h"

#include <chrono>
#include <cmath>

#include "fit/coarse_search.h"
#include "fit/optimisers/annealing.h"

namespace selvedge::cli {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd coordinates_of(const std::vector<fit::Parameter>& parameters, const cloth::Material& m) {
  const double values[] = {m.stretch, m.shear, m.bend, m.stretch_damping, m.shear_damping, m.bend_damping, m.drag_normal, m.drag_tangent, m.drag_fade};
  VectorXd x(static_cast<Index>(parameters.size()));
  for (size_t k = 0; k < parameters.size(); ++k) x(static_cast<Index>(k)) = fit::to_coordinate(parameters[k], values[k]);
  return x;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Costs over the first rows of a set, the others held.
fit::BatchCosts costs_of_first(const FabricCase& c, const std::vector<size_t>& trials, Index searched, const VectorXd& held) {
  return [&c, trials, searched, held](const MatrixXd& points) {
    MatrixXd sets = held.replicate(1, points.cols());
    sets.topRows(searched) = points;
    const VectorXd sum = c.folds->energy(c.parameters, sets, trials).rowwise().sum();
    return std::vector<double>(sum.begin(), sum.end());
  };
}

}  // namespace

std::unique_ptr<FabricCase> prepare_case(const TrueFabric& fabric, const std::filesystem::path& folder, const CaseOptions& options) {
  auto c = std::make_unique<FabricCase>();
  c->truth = fabric;
  FabricTrialOptions record;
  record.columns = options.columns;
  record.frames = options.frames;
  record.frame_rate_hz = options.frame_rate_hz;
  record.seed = options.seed;
  c->campaign = record_fabric(fabric, folder, record);
  c->parameters = fit::base_parameters();
  c->true_coordinates = coordinates_of(c->parameters, fabric.material);

  std::vector<fit::ObservedTrial> observed;
  fit::ObserveOptions observe;
  observe.rate_hz = options.frame_rate_hz;
  for (const trial::Trial& t : c->campaign.trials) observed.push_back(fit::observe_trial(t, observe));
  fit::ObjectiveOptions mesh;
  mesh.columns = options.coarse_columns;
  const fit::Objective coarse(observed, mesh, c->parameters, fit::usual_coordinates(c->parameters));
  c->start = fit::coarse_search(coarse, c->parameters, {}).best.front();
  mesh.columns = options.columns;
  c->scenes = std::make_unique<fit::Objective>(observed, mesh, c->parameters, c->start);
  // Every equilibrium is sought from the shape that the recorded one was: initial conditions match, as the paper's do.
  std::vector<Eigen::Matrix3Xd> hung;
  for (const fit::ObservedTrial& t : observed) hung.push_back(cloth::hung_shape(c->scenes->sheet(), t.experiment, 1));
  c->scenes->set_start(hung);
  for (size_t i = 0; i < observed.size(); ++i) c->tracks.push_back(fit::track_folds(c->campaign.trials[i], {}, observed[i].still));
  c->folds = std::make_unique<fit::FoldObjective>(*c->scenes, c->tracks);
  return c;
}

MatrixXd energies(const FabricCase& c, const MatrixXd& sets, const std::vector<size_t>& trials) { return c.folds->energy(c.parameters, sets, trials); }

double energy_beside(const FabricCase& recorded, const FabricCase& simulated, const VectorXd& set, const std::vector<size_t>& trials) {
  std::vector<fit::Parameter> with_density = simulated.parameters;
  with_density.push_back({"density", "kg/m²", 0.16, 0.01, 2, true, 1, [](fit::Prediction& p, double value) { p.experiment.material.density = value; }});
  VectorXd whole(set.size() + 1);
  whole << set, std::log(simulated.truth.material.density);
  return recorded.folds->energy(with_density, whole, trials).sum();
}

TimedFit anneal_case(const FabricCase& c, size_t trial, Index searched, const VectorXd& start, int evaluations, unsigned seed) {
  const auto begin = std::chrono::steady_clock::now();
  fit::SearchProblem problem = fit::fold_problem(*c.folds, c.parameters, start, {trial});
  problem.lower = problem.lower.head(searched).eval();
  problem.upper = problem.upper.head(searched).eval();
  problem.start = problem.start.head(searched).eval();
  problem.costs = costs_of_first(c, {trial}, searched, start);
  fit::SearchLimits limits;
  limits.evaluations = evaluations;
  limits.seed = seed;
  const fit::SearchResult found = fit::anneal(problem, limits);
  TimedFit out{start, 0, found.evaluations};
  out.set.head(searched) = found.point;
  out.wall_s = seconds_since(begin);
  return out;
}

TimedFit least_squares_case(const FabricCase& c, const std::vector<size_t>& trials, VectorXd& sd) {
  const auto begin = std::chrono::steady_clock::now();
  fit::Objective scenes = *c.scenes;
  fit::LeastSquaresOptions options;
  options.trials = trials;
  options.max_iterations = 25;
  const fit::LeastSquaresResult found = fit::minimise(scenes, c.parameters, c.start, options);
  sd = found.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  return {found.coordinates, seconds_since(begin), found.evaluations};
}

std::vector<double> case_variability(const FabricCase& c, const std::vector<size_t>& trials, Index searched, const VectorXd& set) {
  const std::vector<fit::Parameter> some(c.parameters.begin(), c.parameters.begin() + searched);
  return fit::variability_percent(costs_of_first(c, trials, searched, set), some, set.head(searched));
}

}  // namespace selvedge::cli
