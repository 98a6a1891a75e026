#include "diagnose/study.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "diagnose/hypothesis.h"
#include "files/whole_file.h"
#include "fit/least_squares.h"
#include "fit/observed_trial.h"
#include "fit/robust_cost.h"
#include "fit/stages.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kEnough = 1e-3,
                 kNearEnough = 1e-2;  // of the cost: smaller decreases end a base fit; one that is refitted after

bool applies(const Effect& effect, const std::vector<fit::ObservedTrial>& trials, fit::Drag drag) {
  if (effect.applies_to == AppliesTo::simple_drag) return drag != fit::Drag::nonlinear;
  if (effect.applies_to == AppliesTo::images)
    return std::any_of(trials.begin(), trials.end(), [](const fit::ObservedTrial& t) { return t.stripes != nullptr; });
  return true;
}

// Replicates share a group; so do all still trials that are wanted, which say too little to stand alone.
std::vector<std::vector<size_t>> group_trials(const trial::Campaign& campaign,
                                              const std::vector<fit::ObservedTrial>& trials, bool with_still) {
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

std::vector<fit::Parameter> base_of(const Study& study) {
  return {study.parameters.begin(), study.parameters.begin() + static_cast<std::ptrdiff_t>(study.base_count)};
}

// What the fine mesh adds to each residual at these parameters, mm; zero where it blew up or went another way, from its
// own equilibrium and from that of the coarse one, which was matched to the recording. The fine mesh then starts from
// the equilibria that it found: on it, relaxing takes as long as moving.
std::vector<VectorXd> mesh_change(Study& study, const std::vector<fit::Parameter>& parameters, const VectorXd& x) {
  const fit::Objective& objective = *study.objective;
  fit::Objective& fine = *study.fine;
  const fit::Residuals coarse_r = objective.evaluate(parameters, x).front();
  std::vector<VectorXd> change;
  for (size_t i = 0; i < coarse_r.mm.size(); ++i) change.push_back(VectorXd::Zero(objective.time_s(i).size()));
  if (study.has_one_mesh()) {
    if (coarse_r.finite) fine.set_start(coarse_r.start);
    return change;
  }
  // Of these trials; those that went another way.
  const auto change_of = [&](const fit::Residuals& fine_r, const std::vector<size_t>& trials) {
    std::vector<size_t> parted;
    for (const size_t i : trials) {
      VectorXd d = VectorXd::Zero(change[i].size());
      if (coarse_r.mm[i].size() == d.size() && fine_r.mm[i].size() == d.size()) d = fine_r.mm[i] - coarse_r.mm[i];
      // Residuals already hold the correction that was set before.
      if (!objective.mesh_correction().empty()) d += objective.mesh_correction()[i];
      for (double& value : d)
        if (!std::isfinite(value)) value = 0;
      if (is_mesh_correction(objective, i, d, coarse_r.mm[i])) change[i] = d;
      else parted.push_back(i);
    }
    return parted;
  };
  const fit::Residuals fine_r = fine.evaluate(parameters, x).front();
  if (fine_r.finite) fine.set_start(fine_r.start);
  std::vector<size_t> all(change.size());
  std::iota(all.begin(), all.end(), 0);
  const std::vector<size_t> parted = change_of(fine_r, all);
  if (parted.empty()) return change;
  fine.take_branches_of(objective, parted);
  const fit::Residuals again = fine.evaluate(parameters, x, parted).front();
  ++study.evaluations;
  if (again.finite) fine.set_start(again.start);
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

// Pulls all moving trials twice as hard: so that a fit that starts far off is led by forces, not by folds.
void pull_all_harder(Study& study, double pull_per_s) {
  std::vector<double> pulls = study.objective->pulls();
  for (size_t i = 0; i < pulls.size(); ++i)
    if (!study.objective->scenes()[i].trial.still) pulls[i] = 2 * pull_per_s;
  study.objective->set_pulls(pulls);
}

// Trials that go on being pulled twice as hard, told at x: those that the usual pull does not keep in the recorded
// folds, and those where a finer mesh goes another way.
void choose_pulls(Study& study, const std::vector<fit::Parameter>& base, const VectorXd& x, double pull_per_s) {
  constexpr double kLost_mm = 6;  // models that keep the folds were never found so far off under the pull
  constexpr double kParted_mm = 1.5;
  const size_t trials = study.objective->scenes().size();
  for (fit::Objective* objective : {study.objective.get(), study.fine.get()})
    objective->set_pulls(std::vector<double>(trials, pull_per_s));
  const fit::Residuals coarse = study.objective->evaluate(base, x).front(),
                       fine = study.fine->evaluate(base, x).front();
  if (fine.finite) study.fine->set_start(fine.start);
  study.evaluations += 2;
  std::vector<double> pulls(trials, pull_per_s);
  for (size_t i = 0; i < trials; ++i) {
    const fit::ObservedTrial& trial = study.objective->scenes()[i].trial;
    if (trial.still || !trial.markers) continue;
    const VectorXd time_s = study.objective->time_s(i);
    const bool blew_up = coarse.mm[i].size() != time_s.size() || fine.mm[i].size() != time_s.size();
    if (blew_up || !(fit::rms_mm(trial, coarse.mm[i], time_s) < kLost_mm) ||
        !(fit::rms_mm(trial, fine.mm[i] - coarse.mm[i], time_s) < kParted_mm))
      pulls[i] *= 2;
  }
  for (fit::Objective* objective : {study.objective.get(), study.fine.get()}) objective->set_pulls(pulls);
}

fit::ObjectiveOptions on_mesh_of(int columns, const StudyOptions& options) {
  fit::ObjectiveOptions o;
  o.columns = columns;
  o.pull_per_s = options.pull_per_s;
  o.skipped_s = options.skipped_s;
  o.shared_rests = true;
  // A hundredth of a millimetre is far below what a tracker sees, and half of all work is relaxation.
  o.simulation.rest_change_m = 1e-5;
  o.simulation.rest_speed_m_s = 5e-4;
  o.simulation.longest_rest_s = 5;
  return o;
}

// A damping or a drag that came to lie near its lower bound does nothing there, nor do small changes of it: a fit that
// goes on from it on another mesh would never find it again. So it starts from its usual value.
VectorXd lifted_off_bounds(const std::vector<fit::Parameter>& base, VectorXd x) {
  constexpr double kNear = 3;  // times the lower bound
  for (size_t k = 0; k < base.size(); ++k)
    if (const auto at = static_cast<Index>(k);
        !base[k].at_rest && fit::to_value(base[k], x(at)) < kNear * base[k].lower)
      x(at) = fit::to_coordinate(base[k], base[k].start);
  return x;
}

// The base fit on the coarse mesh and on the usual one, which becomes the study's objective. Where markers pull, moving
// trials are pulled twice as hard, and the end need not be exact: it is refitted on another pull.
VectorXd fit_base(Study& study, const std::vector<fit::ObservedTrial>& trials, const std::vector<fit::Parameter>& base,
                  const StudyOptions& options) {
  VectorXd x = options.start ? lifted_off_bounds(base, options.start->coordinates) : fit::usual_coordinates(base);
  const auto set_pulls = [&] {
    if (options.start) study.objective->set_pulls(options.start->pulls_per_s);
    else if (study.pulled) pull_all_harder(study, options.pull_per_s);
  };
  if (study.pulled || options.start) {
    study.objective = std::make_shared<fit::Objective>(trials, on_mesh_of(options.coarse_columns, options), base, x);
    set_pulls();
    fit::LeastSquaresOptions start = search_options(8, kNearEnough);
    start.progress = fit::part_of(options.progress, 0.02, 0.1, "coarse mesh");
    x = fit::minimise(*study.objective, base, x, start).coordinates;
  } else {
    fit::LeastSquaresOptions start;
    start.progress = fit::part_of(options.progress, 0.02, 0.25, "coarse mesh");
    x = fit::find_start(trials, on_mesh_of(options.coarse_columns, options), base, start).coordinates;
  }
  fit::ObjectiveOptions usual_mesh = on_mesh_of(options.columns, options);
  usual_mesh.branch_of = study.objective.get();
  study.objective = std::make_shared<fit::Objective>(trials, usual_mesh, base, x);
  set_pulls();
  fit::LeastSquaresOptions search = search_options(options.start ? 5 : 8, study.pulled ? kNearEnough : kEnough);
  search.progress = fit::part_of(options.progress, study.pulled ? 0.1 : 0.25, 0.55, "base fit");
  const fit::LeastSquaresResult fitted = fit::minimise_on_branches(*study.objective, base, x, search);
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
void refit_on_fine_mesh(Study& study, const std::vector<fit::Parameter>& base,
                        const report::ProgressCallback& progress) {
  const auto n = static_cast<Index>(study.base_count);
  correct_mesh(study);
  const fit::LeastSquaresResult fitted =
      fit::minimise(*study.objective, base, study.base.head(n), search_options(3, kEnough));
  study.base.head(n) = fitted.coordinates;
  study.evaluations += fitted.evaluations;
  progress(0.5, fmt::format("robust residual {:.2f} sd", fitted.scale));
  settle(study);
  progress(1, fmt::format("robust residual {:.2f} sd", fit::robust_scale(study.residual)));
}

// Nothing where shear is near that of an isotropic sheet, or where a simulation of it blew up.
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
                        [&](const fit::Parameter& p) { return p.name == name; }) -
           study.parameters.begin();
  };
  const Index stretch = named("stretch"), shear = named("shear");
  const double isotropic =
      fit::to_coordinate(study.parameters[static_cast<size_t>(shear)],
                         kShare * fit::to_value(study.parameters[static_cast<size_t>(stretch)], x(stretch)));
  if (std::abs(isotropic - x(shear)) >= kNear) x(shear) = isotropic;
  return x;
}

fit::LeastSquaresOptions search_options(int max_iterations, double least_decrease) {
  fit::LeastSquaresOptions o;
  o.max_iterations = max_iterations;
  o.steps_between = 1;
  o.only_coordinates = true;
  o.least_decrease = least_decrease;
  // Small differences meet edges where a motion folds another way; from 0.03 one base fit in four ended far from the
  // bottom.
  o.difference = 0.1;
  return o;
}

bool is_mesh_correction(const fit::Objective& objective, size_t trial, const VectorXd& change_mm,
                        const VectorXd& left_mm) {
  constexpr double kLargest_mm = 3;
  const fit::ObservedTrial& observed = objective.scenes()[trial].trial;
  const VectorXd time_s = objective.time_s(trial);
  return fit::rms_mm(observed, change_mm, time_s) < std::max(kLargest_mm, fit::rms_mm(observed, left_mm, time_s));
}

MatrixXd residuals_at(const Study& study, const MatrixXd& coordinates, const std::vector<size_t>& trials) {
  const std::vector<fit::Residuals> evaluated = study.objective->evaluate(study.parameters, coordinates, trials);
  MatrixXd out(study.rows->size(), coordinates.cols());
  for (Index k = 0; k < coordinates.cols(); ++k) {
    if (evaluated[static_cast<size_t>(k)].finite) out.col(k) = study.rows->whitened(evaluated[static_cast<size_t>(k)]);
    else out.col(k).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return out;
}

void correct_mesh(Study& study) {
  study.mesh_change = mesh_change(study, base_of(study), study.base.head(static_cast<Index>(study.base_count)));
  study.objective->set_mesh_correction(study.mesh_change);
  study.evaluations += 2;
}

void run_free(Study& study) {
  const std::vector<fit::Parameter> base = base_of(study);
  const VectorXd x = study.base.head(static_cast<Index>(study.base_count));
  study.pulled = false;
  for (fit::Objective* objective : {study.objective.get(), study.fine.get()})
    objective->set_pulls(std::vector<double>(objective->scenes().size(), 0));
  if (!study.has_one_mesh())
    study.objective->rematch(base, x);  // seeking them on a fine mesh took a third of a diagnosis
  study.fine->take_branches_of(*study.objective);
  study.objective->set_mesh_correction({});
  study.mesh_change = mesh_change(study, base, x);
  study.objective->set_mesh_correction(study.mesh_change);
  study.residual = residuals_at(study, study.base).col(0);
  study.evaluations += 3;
}

Study make_study(const trial::Campaign& campaign, const std::vector<Effect>& effects, const StudyOptions& options) {
  Study study;
  study.campaign = campaign.folder.filename().string();
  const std::vector<fit::ObservedTrial> trials = fit::observe_campaign(
      campaign, options.rate_hz, options.image_rate_hz, fit::part_of(options.progress, 0, 0.02, "campaign"));
  const std::vector<fit::Parameter> base = fit::base_parameters(options.drag);
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
  study.pulled = options.pull_per_s > 0 && std::any_of(trials.begin(), trials.end(), [](const fit::ObservedTrial& t) {
                   return t.markers.has_value();
                 });

  const bool is_fitted = options.base_fit && options.base_fit->coordinates.size() == static_cast<Index>(base.size());
  VectorXd x;
  if (is_fitted) {
    x = options.base_fit->coordinates;
    study.objective = std::make_shared<fit::Objective>(trials, on_mesh_of(options.columns, options), base, x);
    study.objective->set_pulls(options.base_fit->pulls_per_s);
  } else {
    x = fit_base(study, trials, base, options);
  }
  fit::ObjectiveOptions on_fine = on_mesh_of(options.fine_columns, options);
  on_fine.branch_of = study.objective.get();  // the equilibrium that was matched to the recording
  study.fine = std::make_shared<fit::Objective>(trials, on_fine, base, x);
  study.fine->set_pulls(study.objective->pulls());
  if (!study.pulled) study.fine->rematch(base, x);
  if (!is_fitted && !options.start && study.pulled) choose_pulls(study, base, x, options.pull_per_s);
  for (size_t i = 0; i < trials.size(); ++i)
    if (study.objective->pulls()[i] > options.pull_per_s) study.pulled_harder.push_back(trials[i].name);
  study.rows = std::make_unique<Rows>(*study.objective);
  study.base = fit::usual_coordinates(study.parameters);
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
