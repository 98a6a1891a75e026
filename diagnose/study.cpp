#include "diagnose/study.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "diagnose/hypothesis.h"
#include "files/whole_file.h"
#include "estimate/least_squares.h"
#include "model/observed_trial.h"
#include "model/trial_error.h"
#include "estimate/robust_cost.h"
#include "fit/stages.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kEnough = 1e-3,
                 kNearEnough = 1e-2;  // of the cost: smaller decreases end a base fit; one that is refitted after

bool applies(const Effect& effect, const std::vector<model::ObservedTrial>& trials, model::Drag drag) {
  if (effect.applies_to == AppliesTo::simple_drag) return drag != model::Drag::nonlinear;
  if (effect.applies_to == AppliesTo::images)
    return std::any_of(trials.begin(), trials.end(),
                       [](const model::ObservedTrial& t) { return t.stripes != nullptr; });
  return true;
}

// Replicates share a group; so do all still trials that are wanted, which say too little to stand alone.
std::vector<std::vector<size_t>> group_trials(const trial::Campaign& campaign,
                                              const std::vector<model::ObservedTrial>& trials, bool with_still) {
  std::vector<std::vector<size_t>> groups;
  std::vector<bool> placed(trials.size(), false);
  for (const std::vector<std::string>& names : campaign.replicates) {
    std::vector<size_t> group;
    for (size_t i = 0; i < trials.size(); ++i)
      if (!placed[i] && !trials[i].still && std::find(names.begin(), names.end(), trials[i].name) != names.end()) {
        placed[i] = true;
        group.push_back(i);
      }
    if (!group.empty()) groups.push_back(group);
  }
  std::vector<size_t> still;
  for (size_t i = 0; i < trials.size(); ++i) {
    if (trials[i].still) still.push_back(i);
    else if (!placed[i]) groups.push_back({i});
  }
  std::sort(groups.begin(), groups.end());
  if (!still.empty() && with_still) groups.push_back(still);
  return groups;
}

std::vector<model::Parameter> base_of(const Study& study) {
  return {study.parameters.begin(), study.parameters.begin() + static_cast<std::ptrdiff_t>(study.base_count)};
}

// What the fine mesh adds to each residual at these parameters, mm; zero where it diverged or went another way, from
// its own equilibrium and from that of the coarse one, which was matched to the recording. The fine mesh then starts
// from the equilibria that it found: on it, relaxing takes as long as moving.
std::vector<VectorXd> mesh_change(Study& study, const std::vector<model::Parameter>& parameters, const VectorXd& x) {
  const model::Simulation &coarse = *study.simulation, &fine = *study.fine;
  const model::Residuals coarse_r = coarse.evaluate(study.state, parameters, x).front();
  std::vector<VectorXd> change;
  for (size_t i = 0; i < coarse_r.mm.size(); ++i) change.push_back(VectorXd::Zero(coarse.time_s(i).size()));
  if (study.has_one_mesh()) {
    if (coarse_r.finite) fine.take_branches(study.fine_state, coarse_r.start);
    return change;
  }
  // Of these trials; those that went another way.
  const auto change_of = [&](const model::Residuals& fine_r, const std::vector<size_t>& trials) {
    std::vector<size_t> parted;
    for (const size_t i : trials) {
      VectorXd d = VectorXd::Zero(change[i].size());
      if (coarse_r.mm[i].size() == d.size() && fine_r.mm[i].size() == d.size()) d = fine_r.mm[i] - coarse_r.mm[i];
      // Residuals already hold the correction that was set before.
      if (!study.state.grid_correction_mm.empty()) d += study.state.grid_correction_mm[i];
      for (double& value : d)
        if (!std::isfinite(value)) value = 0;
      if (is_mesh_correction(coarse, i, d, coarse_r.mm[i])) change[i] = d;
      else parted.push_back(i);
    }
    return parted;
  };
  const model::Residuals fine_r = fine.evaluate(study.fine_state, parameters, x).front();
  if (fine_r.finite) fine.take_branches(study.fine_state, fine_r.start);
  std::vector<size_t> all(change.size());
  std::iota(all.begin(), all.end(), 0);
  const std::vector<size_t> parted = change_of(fine_r, all);
  if (parted.empty()) return change;
  fine.take_branches(study.fine_state, coarse, study.state, parted);
  const model::Residuals again = fine.evaluate(study.fine_state, parameters, x, parted).front();
  ++study.evaluations;
  if (again.finite) fine.take_branches(study.fine_state, again.start);
  change_of(again, parted);
  return change;
}

MatrixXd base_jacobian(Study& study) {
  constexpr double kStep = 0.06;
  const auto n = static_cast<Index>(study.base_count);
  MatrixXd sets(study.base.size(), 2 * n + 1);
  for (Index k = 0; k < sets.cols(); ++k) sets.col(k) = study.base;
  for (Index k = 0; k < n; ++k) {
    sets(k, 2 * k + 1) += kStep;
    sets(k, 2 * k + 2) -= kStep;
  }
  const MatrixXd r = residuals_at(study, sets);
  study.evaluations += static_cast<int>(sets.cols());
  study.residual = r.col(0);
  MatrixXd jacobian(r.rows(), n);
  for (Index k = 0; k < n; ++k) {
    jacobian.col(k) = (r.col(2 * k + 1) - r.col(2 * k + 2)) / (2 * kStep);
    if (!jacobian.col(k).allFinite()) jacobian.col(k).setZero();
  }
  return jacobian;
}

// All moving trials twice as hard: so that a fit that starts far off is led by forces, not by folds.
std::vector<double> pulled_harder(const std::vector<model::ObservedTrial>& trials, double pull_per_s) {
  std::vector<double> pulls;
  for (const model::ObservedTrial& t : trials) pulls.push_back(t.still ? pull_per_s : 2 * pull_per_s);
  return pulls;
}

// Trials that go on being pulled twice as hard, told at x: those that the usual pull does not keep in the recorded
// folds, and those where a finer mesh goes another way.
void choose_pulls(Study& study, const std::vector<model::Parameter>& base, const VectorXd& x, double pull_per_s) {
  constexpr double kLost_mm = 6;  // models that keep the folds were never found so far off under the pull
  constexpr double kParted_mm = 1.5;
  const size_t trials = study.simulation->trials().size();
  for (model::State* state : {&study.state, &study.fine_state}) state->pull_per_s.assign(trials, pull_per_s);
  const model::Residuals coarse = study.simulation->evaluate(study.state, base, x).front(),
                         fine = study.fine->evaluate(study.fine_state, base, x).front();
  if (fine.finite) study.fine->take_branches(study.fine_state, fine.start);
  study.evaluations += 2;
  std::vector<double> pulls(trials, pull_per_s);
  for (size_t i = 0; i < trials; ++i) {
    const model::ObservedTrial& trial = study.simulation->trials()[i];
    if (trial.still || !trial.markers) continue;
    const VectorXd time_s = study.simulation->time_s(i);
    const bool diverged = coarse.mm[i].size() != time_s.size() || fine.mm[i].size() != time_s.size();
    if (diverged || !(model::rms_mm(trial, coarse.mm[i], time_s) < kLost_mm) ||
        !(model::rms_mm(trial, fine.mm[i] - coarse.mm[i], time_s) < kParted_mm))
      pulls[i] *= 2;
  }
  study.state.pull_per_s = study.fine_state.pull_per_s = pulls;
}

model::SimulationOptions on_mesh_of(int columns, const StudyOptions& options) {
  model::SimulationOptions o;
  o.columns = columns;
  o.skipped_s = options.skipped_s;
  o.shared_rests = true;
  // A hundredth of a millimetre is far below what a tracker sees, and half of all work is relaxation.
  o.cloth.rest_change_m = 1e-5;
  o.cloth.rest_speed_m_s = 5e-4;
  o.cloth.longest_rest_s = 5;
  return o;
}

// A damping or a drag that came to lie near its lower bound does nothing there, nor do small changes of it: a fit that
// goes on from it on another mesh would never find it again. So it starts from its usual value.
VectorXd lifted_off_bounds(const std::vector<model::Parameter>& base, VectorXd x) {
  constexpr double kNear = 3;  // times the lower bound
  for (size_t k = 0; k < base.size(); ++k)
    if (const auto at = static_cast<Index>(k);
        !base[k].at_rest && model::to_value(base[k], x(at)) < kNear * base[k].lower)
      x(at) = model::to_coordinate(base[k], base[k].start);
  return x;
}

// The base fit on the coarse mesh and on the usual one, which becomes the study's simulation. Where markers pull,
// moving trials are pulled twice as hard, and the end need not be exact: it is refitted on another pull.
VectorXd fit_base(Study& study, const std::vector<model::ObservedTrial>& trials,
                  const std::vector<model::Parameter>& base, const StudyOptions& options) {
  VectorXd x = options.start ? lifted_off_bounds(base, options.start->coordinates) : model::usual_coordinates(base);
  std::vector<double> pulls(trials.size(), options.pull_per_s);
  if (options.start) pulls = options.start->pulls_per_s;
  else if (study.pulled) pulls = pulled_harder(trials, options.pull_per_s);
  const model::Simulation coarse(trials, on_mesh_of(options.coarse_columns, options));
  model::State on_coarse;
  if (study.pulled || options.start) {
    on_coarse = coarse.state_at(base, x, options.pull_per_s);
    on_coarse.pull_per_s = pulls;
    estimate::LeastSquaresOptions start = search_options(8, kNearEnough);
    start.progress = fit::part_of(options.progress, 0.02, 0.1, "coarse mesh");
    x = minimise(coarse, on_coarse, base, x, start).coordinates;
  } else {
    estimate::LeastSquaresOptions start;
    start.progress = fit::part_of(options.progress, 0.02, 0.25, "coarse mesh");
    x = fit::find_start(trials, on_mesh_of(options.coarse_columns, options), base, start).coordinates;
  }
  study.simulation = std::make_shared<const model::Simulation>(trials, on_mesh_of(options.columns, options));
  if (on_coarse.branch.empty()) study.state = study.simulation->state_at(base, x, options.pull_per_s);
  else study.state = study.simulation->state_of(coarse, on_coarse);
  estimate::LeastSquaresOptions search = search_options(options.start ? 5 : 8, study.pulled ? kNearEnough : kEnough);
  search.progress = fit::part_of(options.progress, study.pulled ? 0.1 : 0.25, 0.55, "base fit");
  const estimate::LeastSquaresResult fitted =
      fit::minimise_on_branches(*study.simulation, study.state, base, x, search);
  study.evaluations += fitted.evaluations;
  return fitted.coordinates;
}

// Finds derivatives and what the fine mesh adds, both at the base fit, and refits by them.
void settle(Study& study) {
  constexpr double kFar = 0.2;  // ln: derivatives brought up to date by Broyden's rule serve within it
  correct_mesh(study);
  study.jacobian = base_jacobian(study);
  std::vector<Hypothesis> arm = {base_hypothesis(study)};
  refit(study, arm, 3, {1e-4, 1e-2, 0.3, 3});
  const double moved = (arm[0].x - study.base).cwiseAbs().maxCoeff();
  study.base = arm[0].x;
  study.residual = arm[0].residual;
  study.jacobian = arm[0].jacobian;
  if (moved > kFar) study.jacobian = base_jacobian(study);
}

// The base fit to what the fine mesh predicts: what it adds is found, and found again after a refit.
void refit_on_fine_mesh(Study& study, const std::vector<model::Parameter>& base,
                        const report::ProgressCallback& progress) {
  const auto n = static_cast<Index>(study.base_count);
  correct_mesh(study);
  const estimate::LeastSquaresResult fitted =
      minimise(*study.simulation, study.state, base, study.base.head(n), search_options(3, kEnough));
  study.base.head(n) = fitted.coordinates;
  study.evaluations += fitted.evaluations;
  progress(0.5, fmt::format("robust residual {:.2f} sd", fitted.scale));
  settle(study);
  progress(1, fmt::format("robust residual {:.2f} sd", estimate::robust_scale(study.residual)));
}

// Nothing where shear is near that of an isotropic sheet, or where a simulation of it diverged.
std::shared_ptr<const Hypothesis> base_of_isotropic_shear(Study& study) {
  std::vector<Hypothesis> arm = {base_hypothesis(study)};
  arm[0].x = with_isotropic_shear(study, arm[0].x);
  if (arm[0].x == study.base) return nullptr;
  refine_mesh(study, arm);
  if (arm[0].mesh_offset.size() == 0) return nullptr;
  relinearise(study, arm);
  return std::make_shared<const Hypothesis>(std::move(arm[0]));
}

// Fits the base model from there as well, and keeps what leaves less. Whether that is the new one.
bool fit_from(Study& study, const Hypothesis& there) {
  constexpr double kLess = 0.99;  // of the cost
  std::vector<Hypothesis> arm = {there};
  refit(study, arm, 3, {1e-3, 0.03, 0.3, 3});
  relinearise(study, arm);
  refit(study, arm, 2, {1e-3, 0.03, 0.3, 3});
  refine_mesh(study, arm);
  if (arm[0].cost > kLess * base_hypothesis(study).cost) return false;
  study.base = arm[0].x;
  settle(study);
  return true;
}

}  // namespace

void write_base_fit(const std::filesystem::path& file, const BaseFit& fit, const std::string& input) {
  std::filesystem::create_directories(file.parent_path());
  files::write_json(file, {{"input", input},
                           {"coordinates", std::vector<double>(fit.coordinates.begin(), fit.coordinates.end())},
                           {"pulls_per_s", fit.pulls_per_s}});
}

std::optional<BaseFit> read_base_fit(const std::filesystem::path& file, size_t trials, const std::string& input) {
  if (!std::filesystem::exists(file)) return {};
  const nlohmann::json stored = files::read_json(file);
  try {
    if (stored.value("input", "") != input) return {};
    const auto values = stored.at("coordinates").get<std::vector<double>>();
    BaseFit fit{Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size())),
                stored.at("pulls_per_s").get<std::vector<double>>()};
    if (fit.pulls_per_s.size() != trials) return {};
    return fit;
  } catch (const nlohmann::json::exception&) {
    return {};  // of another version
  }
}

VectorXd with_isotropic_shear(const Study& study, VectorXd x) {
  constexpr double kShare = 0.4;  // of the stretch stiffness: an isotropic sheet of Poisson's ratio 1/4
  constexpr double kNear = 0.2;   // ln
  const auto named = [&](const char* name) {
    return std::find_if(study.parameters.begin(), study.parameters.end(),
                        [&](const model::Parameter& p) { return p.name == name; }) -
           study.parameters.begin();
  };
  const Index stretch = named("stretch"), shear = named("shear");
  const double isotropic =
      model::to_coordinate(study.parameters[static_cast<size_t>(shear)],
                           kShare * model::to_value(study.parameters[static_cast<size_t>(stretch)], x(stretch)));
  if (std::abs(isotropic - x(shear)) >= kNear) x(shear) = isotropic;
  return x;
}

estimate::LeastSquaresOptions search_options(int max_iterations, double least_decrease) {
  estimate::LeastSquaresOptions o;
  o.max_iterations = max_iterations;
  o.steps_between = 1;
  o.only_coordinates = true;
  o.least_decrease = least_decrease;
  // Small differences meet edges where a motion folds another way; from 0.03 one base fit in four ended far from the
  // bottom.
  o.difference = 0.1;
  return o;
}

bool is_mesh_correction(const model::Simulation& simulation, size_t trial, const VectorXd& change_mm,
                        const VectorXd& left_mm) {
  constexpr double kLargest_mm = 3;
  const model::ObservedTrial& observed = simulation.trials()[trial];
  const VectorXd time_s = simulation.time_s(trial);
  return model::rms_mm(observed, change_mm, time_s) < std::max(kLargest_mm, model::rms_mm(observed, left_mm, time_s));
}

MatrixXd residuals_at(const Study& study, const MatrixXd& coordinates, const std::vector<size_t>& trials) {
  const std::vector<model::Residuals> evaluated =
      study.simulation->evaluate(study.state, study.parameters, coordinates, trials);
  MatrixXd out(study.rows->size(), coordinates.cols());
  for (Index k = 0; k < coordinates.cols(); ++k) {
    if (evaluated[static_cast<size_t>(k)].finite) out.col(k) = study.rows->whitened(evaluated[static_cast<size_t>(k)]);
    else out.col(k).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return out;
}

void correct_mesh(Study& study) {
  study.mesh_change = mesh_change(study, base_of(study), study.base.head(static_cast<Index>(study.base_count)));
  study.state.grid_correction_mm = study.mesh_change;
  study.evaluations += 2;
}

void run_free(Study& study) {
  const std::vector<model::Parameter> base = base_of(study);
  const VectorXd x = study.base.head(static_cast<Index>(study.base_count));
  study.pulled = false;
  for (model::State* state : {&study.state, &study.fine_state})
    state->pull_per_s.assign(study.simulation->trials().size(), 0);
  if (!study.has_one_mesh())
    study.simulation->rematch(study.state, base, x);  // seeking them on a fine mesh took a third of a diagnosis
  study.fine->take_branches(study.fine_state, *study.simulation, study.state);
  study.state.grid_correction_mm.clear();
  study.mesh_change = mesh_change(study, base, x);
  study.state.grid_correction_mm = study.mesh_change;
  study.residual = residuals_at(study, study.base).col(0);
  study.evaluations += 3;
}

Study make_study(const trial::Campaign& campaign, const std::vector<Effect>& effects, const StudyOptions& options) {
  Study study;
  study.campaign = campaign.folder.filename().string();
  const std::vector<model::ObservedTrial> trials = fit::observe_campaign(
      campaign, options.rate_hz, options.image_rate_hz, fit::part_of(options.progress, 0, 0.02, "campaign"));
  const std::vector<model::Parameter> base = model::base_parameters(options.drag);
  study.base_count = base.size();
  study.parameters = base;
  for (const Effect& effect : effects) {
    if (!applies(effect, trials, options.drag)) continue;
    study.first_parameter.push_back(study.parameters.size());
    study.effects.push_back(effect);
    study.parameters.insert(study.parameters.end(), effect.parameters.begin(), effect.parameters.end());
  }
  for (const trial::Trial& trial : campaign.trials) study.cameras.push_back(trial.camera);
  study.groups = group_trials(campaign, trials, options.skipped_s == 0);
  study.pulled = options.pull_per_s > 0 && std::any_of(trials.begin(), trials.end(), [](const model::ObservedTrial& t) {
                   return t.markers.has_value();
                 });

  const bool is_fitted = options.base_fit && options.base_fit->coordinates.size() == static_cast<Index>(base.size());
  VectorXd x;
  if (is_fitted) {
    x = options.base_fit->coordinates;
    study.simulation = std::make_shared<const model::Simulation>(trials, on_mesh_of(options.columns, options));
    study.state = study.simulation->state_at(base, x, options.pull_per_s);
    study.state.pull_per_s = options.base_fit->pulls_per_s;
  } else {
    x = fit_base(study, trials, base, options);
  }
  // The equilibrium that was matched to the recording.
  study.fine = std::make_shared<const model::Simulation>(trials, on_mesh_of(options.fine_columns, options));
  study.fine_state = study.fine->state_of(*study.simulation, study.state);
  if (!study.pulled) study.fine->rematch(study.fine_state, base, x);
  if (!is_fitted && !options.start && study.pulled) choose_pulls(study, base, x, options.pull_per_s);
  for (size_t i = 0; i < trials.size(); ++i)
    if (study.state.pull_per_s[i] > options.pull_per_s) study.pulled_harder.push_back(trials[i].name);
  study.rows = std::make_unique<estimate::Rows>(*study.simulation,
                                                estimate::RowOptions{.trials = {}, .still_samples = kStillSamples});
  study.base = model::usual_coordinates(study.parameters);
  study.base.head(static_cast<Index>(study.base_count)) = x;
  if (is_fitted) {
    correct_mesh(study);
    study.jacobian = base_jacobian(study);
  } else {
    refit_on_fine_mesh(study, base, fit::part_of(options.progress, 0.55, 0.9, "base fit, finer mesh"));
  }
  if (!options.start) {
    options.progress(0.9, "base fit from another start");
    study.other_start = base_of_isotropic_shear(study);
    if (study.other_start && !is_fitted && fit_from(study, *study.other_start))
      study.other_start = base_of_isotropic_shear(study);
  }
  options.progress(1, "base model fitted");
  return study;
}

}  // namespace selvedge::diagnose
