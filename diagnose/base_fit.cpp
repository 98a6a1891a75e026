#include "diagnose/base_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "diagnose/hypothesis.h"
#include "estimate/robust_cost.h"
#include "files/whole_file.h"
#include "fit/stages.h"
#include "model/trial_error.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

bool applies(const Effect& effect, const std::vector<model::ObservedTrial>& trials, model::Drag drag) {
  if (effect.applies_to == AppliesTo::simple_drag) return drag != model::Drag::nonlinear;
  if (effect.applies_to == AppliesTo::images)
    return std::any_of(trials.begin(), trials.end(),
                       [](const model::ObservedTrial& t) { return t.stripes != nullptr; });
  return true;
}

// Replicates share a group; so do all still trials, which say too little to stand alone.
std::vector<std::vector<size_t>> group_trials(const trial::Campaign& campaign,
                                              const std::vector<model::ObservedTrial>& trials) {
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
  if (!still.empty()) groups.push_back(still);
  return groups;
}

// All moving trials harder: so that a fit that starts far off is led by forces, not by folds.
std::vector<double> nudged_harder(const std::vector<model::ObservedTrial>& trials, const Protocol& protocol) {
  std::vector<double> gains;
  for (const model::ObservedTrial& t : trials)
    gains.push_back(t.still ? protocol.nudging_per_s : protocol.harder * protocol.nudging_per_s);
  return gains;
}

// Trials that go on being nudged harder, told at x: those that the usual gain does not keep in the recorded
// folds, and those where a finer grid goes another way.
void choose_gains(Study& study, const std::vector<model::Parameter>& base, const VectorXd& x) {
  const double nudging_per_s = study.protocol.nudging_per_s;
  const size_t trials = study.simulation->trials().size();
  for (model::State* state : {&study.state, &study.fine_state}) state->nudging_per_s.assign(trials, nudging_per_s);
  const model::Residuals coarse = study.simulation->evaluate(study.state, base, x).front(),
                         fine = study.fine->evaluate(study.fine_state, base, x).front();
  if (fine.finite) study.fine->take_branches(study.fine_state, fine.start);
  study.evaluations += 2;
  std::vector<double> gains(trials, nudging_per_s);
  for (size_t i = 0; i < trials; ++i) {
    const model::ObservedTrial& trial = study.simulation->trials()[i];
    if (trial.still || !trial.markers) continue;
    const VectorXd time_s = study.simulation->time_s(i);
    const bool diverged = coarse.mm[i].size() != time_s.size() || fine.mm[i].size() != time_s.size();
    if (diverged || !(model::rms_mm(trial, coarse.mm[i], time_s) < study.protocol.lost_mm) ||
        !(model::rms_mm(trial, fine.mm[i] - coarse.mm[i], time_s) < study.protocol.parted_mm))
      gains[i] *= study.protocol.harder;
  }
  study.state.nudging_per_s = study.fine_state.nudging_per_s = gains;
}

model::SimulationOptions on_grid_of(long cells) {
  model::SimulationOptions o;
  o.cells = static_cast<int>(cells);
  o.sheet.rest_change_m = 1e-5;  // a hundredth of a millimetre is far below what a tracker sees
  return o;
}

// One cell a bending length of the base at x, unless the protocol says how many; and the study's simulation on it.
void begin_usual_grid(Study& study, const std::vector<model::ObservedTrial>& trials,
                      const std::vector<model::Parameter>& base, const VectorXd& x) {
  long& cells = study.protocol.cells;
  if (cells == 0)
    cells = std::clamp<long>(model::cells_of_bending_length(trials.front(), base, x), study.protocol.coarse_cells,
                             study.protocol.most_cells);
  study.simulation = std::make_shared<const model::Simulation>(trials, on_grid_of(cells));
}

// The base fit on the coarse grid and on the usual one, which becomes the study's simulation. Where markers nudge,
// moving trials are nudged twice as hard, and the end need not be exact: it is refitted with another gain.
VectorXd fit_base(Study& study, const std::vector<model::ObservedTrial>& trials,
                  const std::vector<model::Parameter>& base, const StudyOptions& options) {
  const Protocol& protocol = options.protocol;
  VectorXd x = model::usual_coordinates(base);
  std::vector<double> gains(trials.size(), protocol.nudging_per_s);
  if (study.nudged) gains = nudged_harder(trials, protocol);
  if (options.fitted) {
    x = *options.fitted;
    begin_usual_grid(study, trials, base, x);
    study.state = study.simulation->state_at(base, x, protocol.nudging_per_s);
  } else if (study.nudged) {
    const model::Simulation coarse(trials, on_grid_of(protocol.coarse_cells));
    model::State on_coarse = coarse.state_at(base, x, protocol.nudging_per_s);
    on_coarse.nudging_per_s = gains;
    estimate::LeastSquaresOptions start = search_options(8, protocol.near_enough);
    start.progress = fit::part_of(options.progress, 0.02, 0.1, "coarse grid");
    x = minimise(coarse, on_coarse, base, x, start).coordinates;
    begin_usual_grid(study, trials, base, x);
    study.state = study.simulation->state_of(coarse, on_coarse);
  } else {
    estimate::LeastSquaresOptions start;
    start.progress = fit::part_of(options.progress, 0.02, 0.25, "coarse grid");
    x = fit::find_start(trials, on_grid_of(protocol.coarse_cells),
                        protocol.cells > 0 ? static_cast<int>(protocol.coarse_cells) : fit::kMostCellsAtFirst, base,
                        start)
            .coordinates;
    begin_usual_grid(study, trials, base, x);
    study.state = study.simulation->state_at(base, x, protocol.nudging_per_s);
  }
  study.state.nudging_per_s = gains;
  estimate::LeastSquaresOptions search = search_options(8, study.nudged ? protocol.near_enough : protocol.enough);
  search.progress = fit::part_of(options.progress, study.nudged ? 0.1 : 0.25, 0.55, "base fit");
  const estimate::LeastSquaresResult fitted =
      fit::minimise_on_branches(*study.simulation, study.state, base, x, search);
  study.evaluations += fitted.evaluations;
  return fitted.coordinates;
}

// Finds derivatives and what the fine grid adds, both at the base fit, and refits by them.
void refit_on_grid_correction(Study& study) {
  correct_mesh(study);
  linearise(study);
  std::vector<Hypothesis> arm = {base_hypothesis(study)};
  refit(study, arm, 3, {1e-4, 1e-2, 0.3, 3});
  const double moved = (arm[0].x - study.base).cwiseAbs().maxCoeff();
  study.base = arm[0].x;
  study.residual = arm[0].residual;
  study.jacobian = arm[0].jacobian;
  if (moved > study.protocol.updated_within) linearise(study);
}

// The base fit to what the fine grid predicts: what it adds is found, and found again after a refit.
void refit_on_fine_grid(Study& study, const std::vector<model::Parameter>& base,
                        const report::ProgressCallback& progress) {
  const auto n = static_cast<Index>(study.base_count);
  correct_mesh(study);
  const estimate::LeastSquaresResult fitted =
      minimise(*study.simulation, study.state, base, study.base.head(n), search_options(3, study.protocol.enough));
  study.base.head(n) = fitted.coordinates;
  study.evaluations += fitted.evaluations;
  progress(0.5, fmt::format("robust residual {:.2f} sd", fitted.scale));
  refit_on_grid_correction(study);
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

// Fits the base model from there as well, and keeps what leaves less.
void fit_from(Study& study, const Hypothesis& there) {
  std::vector<Hypothesis> arm = {there};
  refit(study, arm, 3, {1e-3, 0.03, 0.3, 3});
  relinearise(study, arm);
  refit(study, arm, 2, {1e-3, 0.03, 0.3, 3});
  refine_mesh(study, arm);
  if (arm[0].cost > study.protocol.other_start_gain * base_hypothesis(study).cost) return;
  study.base = arm[0].x;
  refit_on_grid_correction(study);
}

// The fine grid, from the equilibria of the usual one, which were matched to the recording.
void begin_fine_grid(Study& study, const std::vector<model::ObservedTrial>& trials) {
  const double cells = study.protocol.finer * static_cast<double>(study.protocol.cells);
  study.fine = std::make_shared<const model::Simulation>(trials, on_grid_of(std::lround(cells)));
  study.fine_state = study.fine->state_of(*study.simulation, study.state);
}

void begin_rows(Study& study) {
  study.rows = std::make_unique<estimate::Rows>(
      *study.simulation, estimate::RowOptions{.trials = {}, .still_samples = study.protocol.still_samples});
}

// The base fit, in full: on the usual grid, then to what the fine one predicts, then from another start.
BaseFit fit_base_model(Study& study, const std::vector<model::ObservedTrial>& trials,
                       const std::vector<model::Parameter>& base, const StudyOptions& options) {
  const VectorXd x = fit_base(study, trials, base, options);
  begin_fine_grid(study, trials);
  if (!study.nudged) study.fine->rematch(study.fine_state, base, x);
  if (study.nudged) choose_gains(study, base, x);
  begin_rows(study);
  study.base = model::usual_coordinates(study.parameters);
  study.base.head(x.size()) = x;
  refit_on_fine_grid(study, base, fit::part_of(options.progress, 0.55, 0.85, "base fit, finer grid"));
  options.progress(0.85, "base fit from another start");
  if (const auto there = base_of_isotropic_shear(study)) fit_from(study, *there);
  BaseFit out{study.base.head(x.size()), study.protocol.cells, study.state, study.fine_state};
  out.state.grid_correction_mm.clear();
  return out;
}

// All that a study holds at its base fit, from the fit alone.
void begin_at(Study& study, const std::vector<model::ObservedTrial>& trials, const std::vector<model::Parameter>& base,
              const BaseFit& fit, const StudyOptions& options) {
  if (!study.simulation) {
    if (fit.cells > 0) study.protocol.cells = fit.cells;
    begin_usual_grid(study, trials, base, fit.coordinates);
  }
  const bool is_whole = !fit.state.branch.empty();
  study.state = is_whole ? fit.state : study.simulation->state_at(base, fit.coordinates, study.protocol.nudging_per_s);
  if (!study.fine || !is_whole) begin_fine_grid(study, trials);
  if (is_whole) study.fine_state = fit.fine_state;
  if (!study.rows) begin_rows(study);
  for (size_t i = 0; i < trials.size(); ++i)
    if (study.state.nudging_per_s[i] > study.protocol.nudging_per_s) study.nudged_harder.push_back(trials[i].name);
  study.base = model::usual_coordinates(study.parameters);
  study.base.head(static_cast<Index>(base.size())) = fit.coordinates;
  correct_mesh(study);
  linearise(study);
  options.progress(0.95, "derivatives at the base fit");
  study.other_start = base_of_isotropic_shear(study);
}

nlohmann::json to_json(const model::State& state) {
  nlohmann::json branches = nlohmann::json::array();
  for (const Eigen::Matrix3Xd& shape : state.branch)
    branches.push_back(std::vector<double>(shape.data(), shape.data() + shape.size()));
  return {{"branch", branches}, {"nudging_per_s", state.nudging_per_s}};
}

model::State state_of(const nlohmann::json& json) {
  model::State state;
  for (const nlohmann::json& branch : json.at("branch")) {
    const auto numbers = branch.get<std::vector<double>>();
    state.branch.push_back(
        Eigen::Map<const Eigen::Matrix3Xd>(numbers.data(), 3, static_cast<Index>(numbers.size() / 3)));
  }
  state.nudging_per_s = json.at("nudging_per_s").get<std::vector<double>>();
  return state;
}

}  // namespace

void write_base_fit(const std::filesystem::path& file, const BaseFit& fit, const std::string& input) {
  std::filesystem::create_directories(file.parent_path());
  files::write_json(file, {{"input", input},
                           {"cells", fit.cells},
                           {"coordinates", std::vector<double>(fit.coordinates.begin(), fit.coordinates.end())},
                           {"state", to_json(fit.state)},
                           {"fine_state", to_json(fit.fine_state)}});
}

std::optional<BaseFit> read_base_fit(const std::filesystem::path& file, const std::string& input) {
  if (!std::filesystem::exists(file)) return {};
  const nlohmann::json stored = files::read_json(file);
  try {
    if (stored.value("input", "") != input) return {};
    const auto values = stored.at("coordinates").get<std::vector<double>>();
    return BaseFit{Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size())),
                   stored.at("cells").get<long>(), state_of(stored.at("state")), state_of(stored.at("fine_state"))};
  } catch (const nlohmann::json::exception&) {
    return {};  // of another version
  }
}

FittedStudy make_study(const trial::Campaign& campaign, const std::vector<Effect>& effects,
                       const StudyOptions& options) {
  Study study;
  study.protocol = options.protocol;
  study.campaign = campaign.folder.filename().string();
  const std::vector<model::ObservedTrial> trials =
      fit::observe_campaign(campaign, options.protocol.rate_hz, options.protocol.image_rate_hz,
                            fit::part_of(options.progress, 0, 0.02, "campaign"));
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
  study.groups = group_trials(campaign, trials);
  study.nudged =
      options.protocol.nudging_per_s > 0 &&
      std::any_of(trials.begin(), trials.end(), [](const model::ObservedTrial& t) { return t.markers.has_value(); });

  FittedStudy out{std::move(study), {}};
  out.base_fit = options.base_fit ? *options.base_fit : fit_base_model(out.study, trials, base, options);
  begin_at(out.study, trials, base, out.base_fit, options);
  options.progress(1, "base model fitted");
  return out;
}

}  // namespace selvedge::diagnose
