#include "experiments/fabric_case.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cloth/material_parameters.h"
#include "files/bad_input.h"
#include "fit/coarse_search.h"
#include "fit/stages.h"
#include "model/trial_error.h"

namespace selvedge::experiments {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd coordinates_of(const std::vector<model::Parameter>& parameters, const cloth::Material& m) {
  VectorXd x(static_cast<Index>(parameters.size()));
  for (size_t k = 0; k < parameters.size(); ++k)
    x(static_cast<Index>(k)) =
        model::to_coordinate(parameters[k], std::max(m.*cloth::material_parameter(parameters[k].name).member, 1e-12));
  return x;
}

void require_images(const trial::Campaign& campaign) {
  for (const trial::Trial& t : campaign.trials)
    if (!t.frames)
      refuse((t.folder / "trial.json").string(),
             "found no frames, expected images: error = \"folds\" compares pictures; \"residuals\" does not");
}

// Where the simulated sheet starts from the shape that the recorded one was in, initial conditions match, as the
// paper's do; a recorded fabric's branch is decided from its first frame.
void hang_as_recorded(Comparison& on) {
  std::vector<Eigen::Matrix3Xd> hung;
  for (const model::ObservedTrial& t : on.scenes->trials())
    hung.push_back(hung_shape(on.scenes->sheet(), t.experiment, 1));
  on.scenes->take_branches(on.state, hung);
}

void track_fitted(FabricCase& c, Kind kind, const FitPlan& plan) {
  fit::FoldTrackOptions options;
  options.rate_hz = plan.frame_rate_hz;
  for (size_t i = 0; i < c.observed.size(); ++i) {
    const bool whole = is_predicted(kind, c.campaign.trials[i].experiment);
    options.most_frames = whole ? std::numeric_limits<size_t>::max() : static_cast<size_t>(plan.frames);
    c.fitted.tracks.push_back(fit::track_folds(c.campaign.trials[i], options, c.observed[i].still));
  }
  c.fitted.folds = std::make_unique<fit::FoldObjective>(*c.fitted.scenes, c.fitted.state, c.fitted.tracks);
}

void prepare_later(FabricCase& c, const FitPlan& plan) {
  std::vector<model::ObservedTrial> whole;
  observe::ObserveOptions observe;
  observe.rate_hz = plan.frame_rate_hz;
  for (const trial::Trial& t : c.campaign.trials) whole.push_back(model::observe_trial(t, observe));
  model::SimulationOptions on_grid;
  on_grid.cells = plan.cells;
  c.later.scenes = std::make_unique<const model::Simulation>(whole, on_grid);
  c.later.state = c.later.scenes->state_of(*c.fitted.scenes, c.fitted.state);
  if (c.error == ErrorKind::residuals) return;
  fit::FoldTrackOptions options;
  options.rate_hz = plan.frame_rate_hz;
  options.most_frames = std::numeric_limits<size_t>::max();
  for (size_t i = 0; i < whole.size(); ++i) {
    fit::FoldTrack track = fit::track_folds(c.campaign.trials[i], options, whole[i].still);
    const auto first = std::upper_bound(track.time_s.begin(), track.time_s.end(), c.cut_s) - track.time_s.begin();
    track.time_s.erase(track.time_s.begin(), track.time_s.begin() + first);
    track.recorded.erase(track.recorded.begin(), track.recorded.begin() + first);
    c.later.tracks.push_back(std::move(track));
  }
  c.later.folds = std::make_unique<fit::FoldObjective>(*c.later.scenes, c.later.state, c.later.tracks);
}

// Time of a trial's last sample that can be compared.
double end_s(const trial::Trial& t) {
  if (t.frames && !t.markers) return t.frames->time_s.back();
  return t.markers ? t.markers->time_s.back() : t.corners.time_s.back();
}

double begin_s(const trial::Trial& t) {
  return t.frames && !t.markers ? t.frames->time_s.front() : t.corners.time_s.front();
}

MatrixXd errors_in(const FabricCase& c, const Comparison& on, const std::vector<model::Parameter>& parameters,
                   const MatrixXd& sets, const std::vector<size_t>& trials, double from_s) {
  if (c.error == ErrorKind::folds) return on.folds->energy(parameters, sets, trials);
  MatrixXd all(sets.cols(), static_cast<Index>(trials.size()));
  const std::vector<model::Residuals> residuals = on.scenes->evaluate(on.state, parameters, sets, trials);
  for (Index set = 0; set < sets.cols(); ++set)
    for (size_t t = 0; t < trials.size(); ++t) {
      const VectorXd& mm = residuals[static_cast<size_t>(set)].mm[trials[t]];
      all(set, static_cast<Index>(t)) =
          mm.size() == 0 ? std::numeric_limits<double>::infinity()
                         : model::rms_mm(on.scenes->trials()[trials[t]], mm, on.scenes->time_s(trials[t]), from_s);
    }
  return all;
}

}  // namespace

std::unique_ptr<FabricCase> prepare_case(const Fabric& fabric, const trial::Campaign& campaign, Kind kind,
                                         const FitPlan& plan, const report::ProgressCallback& progress) {
  if (plan.error == ErrorKind::folds) require_images(campaign);
  auto c = std::make_unique<FabricCase>();
  c->fabric = fabric;
  c->campaign = campaign;
  c->error = plan.error;
  c->coarse_cells = plan.coarse_cells;
  const trial::Fabric& first = campaign.trials.front().fabric;
  c->density = first.mass_kg / (first.width_m * first.height_m);
  c->parameters = model::base_parameters();
  if (!fabric.recorded()) c->truth = coordinates_of(c->parameters, fabric.material);

  observe::ObserveOptions observe;
  observe.rate_hz = plan.frame_rate_hz;
  const double fitted_s = (plan.frames - 0.5) / plan.frame_rate_hz;
  estimate::LeastSquaresOptions search;
  for (const trial::Trial& t : c->campaign.trials) {
    const bool whole = is_predicted(kind, t.experiment);
    observe.to_s = whole ? 1e9 : begin_s(t) + fitted_s;
    if (kind == Kind::generalisation && end_s(t) > observe.to_s) c->cut_s = observe.to_s;
    if (!whole) search.trials.push_back(c->observed.size());
    c->observed.push_back(model::observe_trial(t, observe));
    progress(0.5 * static_cast<double>(c->observed.size()) / static_cast<double>(campaign.trials.size()),
             "reading " + t.name);
  }
  model::SimulationOptions on_grid;
  on_grid.cells = plan.coarse_cells;
  search.progress = fit::part_of(progress, 0.5, 1, "start");
  c->start = model::usual_coordinates(c->parameters);
  if (plan.from_grid) {
    const model::Simulation grid(c->observed, on_grid);
    c->start = fit::coarse_search(grid, grid.state_at(c->parameters, c->start), c->parameters, search).best.front();
  }
  on_grid.cells = plan.cells;
  c->fitted.scenes = std::make_unique<const model::Simulation>(c->observed, on_grid);
  c->fitted.state = c->fitted.scenes->state_at(c->parameters, c->start);
  if (!fabric.recorded()) hang_as_recorded(c->fitted);
  if (c->error == ErrorKind::folds) track_fitted(*c, kind, plan);
  if (c->cut_s < 1e299) prepare_later(*c, plan);
  return c;
}

std::vector<size_t> trials_of(const FabricCase& c, trial::Experiment kind) {
  std::vector<size_t> trials;
  for (size_t i = 0; i < c.campaign.trials.size(); ++i)
    if (c.campaign.trials[i].experiment == kind) trials.push_back(i);
  return trials;
}

bool goes_on(const FabricCase& c, size_t trial) {
  return c.later.scenes && !c.observed[trial].still && end_s(c.campaign.trials[trial]) > c.cut_s;
}

MatrixXd errors(const FabricCase& c, const MatrixXd& sets, const std::vector<size_t>& trials) {
  return errors_in(c, c.fitted, c.parameters, sets, trials, -1e300);
}

MatrixXd later_errors(const FabricCase& c, const MatrixXd& sets, const std::vector<size_t>& trials) {
  return errors_in(c, c.later, c.parameters, sets, trials, c.cut_s);
}

double error_beside(const FabricCase& recorded, const FabricCase& simulated, const VectorXd& set,
                    const std::vector<size_t>& trials) {
  std::vector<model::Parameter> with_density = simulated.parameters;
  with_density.push_back({"density", "kg/m²", 0.16, 0.01, 2, true, 1,
                          [](model::Prediction& p, double value) { p.experiment.material.density = value; }});
  VectorXd whole(set.size() + 1);
  whole << set, std::log(simulated.density);
  return errors_in(recorded, recorded.fitted, with_density, whole, trials, -1e300).sum();
}

estimate::BatchCosts costs_of_first(const FabricCase& c, const std::vector<size_t>& trials, Index searched,
                                    const VectorXd& held) {
  return [&c, trials, searched, held](const MatrixXd& points) {
    MatrixXd sets = held.replicate(1, points.cols());
    sets.topRows(searched) = points;
    const VectorXd sum = errors(c, sets, trials).rowwise().sum();
    return std::vector<double>(sum.begin(), sum.end());
  };
}

}  // namespace selvedge::experiments
