#include "diagnose/base_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/trial/doubts.h"
#include "estimate/least_squares.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "fit/stages.h"
#include "fit/tested_parameters.h"
#include "model/excerpts.h"
#include "model/held_markers.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

bool applies(const Effect& effect, const std::vector<model::ObservedTrial>& trials, model::Drag drag) {
  const auto any = [&](const auto& holds) { return std::any_of(trials.begin(), trials.end(), holds); };
  const auto has_images = [](const model::ObservedTrial& t) { return t.stripes && !t.stripes->of_cloud; };
  const auto is_scanned = [](const model::ObservedTrial& t) { return t.stripes && t.stripes->of_cloud; };
  const auto is_scanned_from = [&](const model::ObservedTrial& t) { return is_scanned(t) && t.camera_centre; };
  switch (effect.applies_to) {
    case AppliesTo::anything: return true;
    case AppliesTo::simple_drag: return drag != model::Drag::nonlinear;
    case AppliesTo::images: return any(has_images);
    case AppliesTo::points: return has_markers(trials);
    case AppliesTo::places: return has_markers(trials) || any(is_scanned);
    case AppliesTo::distances: return has_markers(trials) || any(is_scanned_from);
    case AppliesTo::outlines: return any(has_images) || any(is_scanned) || any(model::is_outline_grid);
    case AppliesTo::grids: return any(model::is_outline_grid);
  }
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

model::SimulationOptions on_grid_of(long cells) {
  model::SimulationOptions o;
  o.cells = static_cast<int>(cells);
  o.sheet.rest_change_m = 1e-5;  // a hundredth of a millimetre is far below what a tracker sees
  return o;
}

long usual_cells(const Protocol& protocol, const std::vector<model::ObservedTrial>& trials,
                 const std::vector<model::Parameter>& base, const VectorXd& x) {
  if (protocol.cells > 0) return protocol.cells;
  const double one_each = model::cells_of_bending_length(trials.front(), base, x);
  const double lengths = has_markers(trials) ? protocol.lengths_a_cell : protocol.seen_lengths_a_cell;
  return std::clamp(static_cast<long>(std::ceil(one_each / lengths)), protocol.coarse_cells, protocol.most_cells);
}

// On which the way to where a model is likeliest is found.
long coarser_cells(const Protocol& protocol, long cells) {
  return std::min(cells, std::max(protocol.coarse_cells, std::lround(static_cast<double>(cells) / protocol.coarser)));
}

// What is looked at on a grid: the finer it is, the dearer a second.
std::vector<model::ObservedTrial> looked_at_on(long cells, const Protocol& protocol, const Measured& measured,
                                               const std::vector<model::ObservedTrial>& trials) {
  const double share = std::min(1.0, static_cast<double>(protocol.coarse_cells) / static_cast<double>(cells));
  return model::excerpts(trials, {.most_motion_s = share * protocol.most_motion_s,
                                  .lead_s = protocol.lead_s,
                                  .delay_s = measured.delay ? measured.delay->delay_s : 0,
                                  .pictures = true});
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

// Where least squares begin: x brought nearer on a coarse grid, where there are markers nudged towards them.
fit::Start start_on_coarse(const std::vector<model::ObservedTrial>& observed, const Measured& measured,
                           const std::vector<model::Parameter>& base, const VectorXd& x, const StudyOptions& options) {
  const Protocol& protocol = options.protocol;
  const std::vector<model::ObservedTrial> trials = looked_at_on(protocol.coarse_cells, protocol, measured, observed);
  const model::SimulationOptions grid = on_grid_of(protocol.coarse_cells);
  const bool nudged = has_markers(trials);
  auto search = nudged ? search_options(8, protocol.near_enough) : estimate::LeastSquaresOptions{};
  search.progress = fit::part_of(options.progress, 0.05, 0.4, "coarse grid");
  const int most_cells = protocol.cells > 0 ? grid.cells : fit::kMostCellsAtFirst;
  if (!nudged) return fit::find_start(trials, grid, most_cells, base, search);
  const model::Simulation coarse(trials, grid);
  model::State on_coarse = coarse.state_at(base, x, protocol.nudging_per_s);
  // Nudged harder, so that a fit that starts far off is led by forces, not by folds.
  for (size_t i = 0; i < trials.size(); ++i)
    if (!trials[i].still) on_coarse.nudging_per_s[i] = protocol.harder * protocol.nudging_per_s;
  const estimate::LeastSquaresResult found = minimise(coarse, on_coarse, base, x, search);
  return {found.coordinates, found.evaluations};
}

BaseFit fit_base(const std::vector<model::ObservedTrial>& observed, const Measured& measured,
                 const std::vector<model::Parameter>& base, const fit::Start& start, const StudyOptions& options,
                 int& evaluations) {
  const Protocol& protocol = options.protocol;
  const long cells = usual_cells(protocol, observed, base, start.coordinates);
  const std::vector<model::ObservedTrial> trials = looked_at_on(cells, protocol, measured, observed);
  const model::Simulation simulation(trials, on_grid_of(coarser_cells(protocol, cells)));
  model::State state = simulation.state_at(base, start.coordinates, has_markers(trials) ? protocol.nudging_per_s : 0);
  estimate::LeastSquaresOptions search = search_options(8, protocol.enough);
  search.progress = fit::part_of(options.progress, 0.4, 0.95, "base fit");
  const estimate::LeastSquaresResult fitted =
      fit::minimise_on_branches(simulation, state, base, start.coordinates, search);
  evaluations += start.evaluations + fitted.evaluations;
  if (simulation.options().cells < cells) state.branch.clear();  // of another grid
  return {fitted.coordinates, cells, state.branch};
}

// In a fit that lacks an effect shear, damping and drag stand in for it, as far as their bounds let them. The windows
// begin where fabrics are: shear of a share of the stretch stiffness, damping and drag near what is usual.
VectorXd near_usual(const Protocol& protocol, const std::vector<model::Parameter>& base, VectorXd x) {
  for (size_t k = 0; k < base.size(); ++k) {
    const auto at = static_cast<Index>(k);
    const double usual = model::to_coordinate(base[k], base[k].start);
    if (!base[k].at_rest) x(at) = std::clamp(x(at), usual - protocol.usual_within, usual + protocol.usual_within);
  }
  const auto stretch = static_cast<Index>(place_of(base, "stretch")),
             shear = static_cast<Index>(place_of(base, "shear"));
  x(shear) =
      std::clamp(x(shear), x(stretch) + std::log(protocol.least_shear), x(stretch) + std::log(protocol.most_shear));
  return x;
}

// What held markers show is where everything begins: the delay, and all of an outline's jumps that stand out of noise.
void begin_with_measured(Study& study, const std::vector<model::ObservedTrial>& trials) {
  const Measured& m = study.measured;
  bool jumps = false;
  for (size_t t = 0; t < trials.size(); ++t)
    jumps = jumps || (trials[t].markers && m.middle_m[t] > trials[t].markers->noise_m);
  for (size_t k = study.base_count; k < study.first_force; ++k) {
    const model::Parameter& p = study.parameters[k];
    double& x = study.base(static_cast<Index>(k));
    if (p.name == "delay" && m.delay) x = model::to_coordinate(p, m.delay->delay_s);
    if (p.name == "jitter_share" && jumps) x = model::to_coordinate(p, 1);
  }
}

std::vector<Index> rows_of_base(const Study& study) {
  std::vector<Index> out(study.base_count);
  std::iota(out.begin(), out.end(), 0);
  return out;
}

// What a clock does to all that is seen alike. A fit that cannot move it bends the fabric's parameters in its place:
// with stamps a fifth of a second late a base ended with a tenth of the shear and ten times the stretch stiffness.
std::vector<Index> rows_of_clock(const Study& study) {
  std::vector<Index> out;
  for (size_t k = study.base_count; k < study.first_force; ++k)
    if (is_of_clock(study.parameters[k])) out.push_back(static_cast<Index>(k));
  return out;
}

BaseFit fit_base_with_clock(const std::vector<model::ObservedTrial>& trials, Study& study,
                            const StudyOptions& options) {
  std::vector<Index> rows = rows_of_base(study);
  const std::vector<Index> clock = rows_of_clock(study);
  rows.insert(rows.end(), clock.begin(), clock.end());
  const std::vector<model::Parameter> fitted = model::only(study.parameters, rows, study.base);
  fit::Start start{study.base(rows)};
  if (options.fitted) start.coordinates.head(options.fitted->size()) = *options.fitted;
  else start = start_on_coarse(trials, study.measured, fitted, start.coordinates, options);
  BaseFit out = fit_base(trials, study.measured, fitted, start, options, study.evaluations);
  for (size_t k = 0; k < clock.size(); ++k)
    out.clock[fitted[study.base_count + k].name] = out.coordinates(static_cast<Index>(study.base_count + k));
  out.coordinates.conservativeResize(static_cast<Index>(study.base_count));
  return out;
}

}  // namespace

void write_base_fit(const std::filesystem::path& file, const BaseFit& fit, const std::string& input) {
  std::filesystem::create_directories(file.parent_path());
  nlohmann::json branches = nlohmann::json::array();
  for (const Eigen::Matrix3Xd& shape : fit.branch)
    branches.push_back(std::vector<double>(shape.data(), shape.data() + shape.size()));
  files::write_json(file, {{"input", input},
                           {"cells", fit.cells},
                           {"coordinates", std::vector<double>(fit.coordinates.begin(), fit.coordinates.end())},
                           {"clock", fit.clock},
                           {"branch", branches}});
}

std::optional<BaseFit> read_base_fit(const std::filesystem::path& file, const std::string& input) {
  if (!std::filesystem::exists(file)) return {};
  const nlohmann::json stored = files::read_json(file);
  try {
    if (stored.value("input", "") != input) return {};
    const auto values = stored.at("coordinates").get<std::vector<double>>();
    BaseFit fit{Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size())),
                stored.at("cells").get<long>(),
                {},
                stored.at("clock").get<std::map<std::string, double>>()};
    for (const nlohmann::json& branch : stored.at("branch")) {
      const auto numbers = branch.get<std::vector<double>>();
      fit.branch.push_back(
          Eigen::Map<const Eigen::Matrix3Xd>(numbers.data(), 3, static_cast<Index>(numbers.size() / 3)));
    }
    return fit;
  } catch (const nlohmann::json::exception&) {
    return {};  // of another version
  }
}

FittedStudy make_study(const trial::Campaign& campaign, const std::vector<Effect>& effects,
                       const StudyOptions& options) {
  FittedStudy out;
  Study& study = out.study;
  study.protocol = options.protocol;
  study.campaign = campaign.folder.filename().string();
  const trial::Campaign rig = trial::only_tests(campaign, false);
  if (rig.trials.empty())
    refuse(campaign.folder.string(), "found material tests alone, expected a fabric that hangs from a rig");
  std::vector<model::ObservedTrial> trials =
      fit::observe_campaign(rig, options.protocol.rate_hz, options.protocol.image_rate_hz,
                            fit::part_of(options.progress, 0, 0.05, "campaign"), observe::Thinning::averaged);
  for (model::ObservedTrial& trial : trials) trial.experiment.stop = options.stop;
  if (options.seen_instead) options.seen_instead(trials);
  study.measured = measure(trials, options.protocol);
  const fit::TestedParameters tested = fit::tested_parameters(campaign, options.drag);
  std::vector<model::Parameter> base = tested.parameters;
  study.remarks = tested.remarks;
  study.doubts = trial::doubts(rig);
  study.base_count = base.size();
  study.parameters = base;
  for (const Effect& effect : effects) {
    if (!applies(effect, trials, options.drag)) continue;
    study.first_parameter.push_back(study.parameters.size());
    study.effects.push_back(effect);
    study.parameters.insert(study.parameters.end(), effect.parameters.begin(), effect.parameters.end());
  }
  study.right_scale = has_markers(trials) ? study.protocol.right_scale : study.protocol.seen_right_scale;
  study.first_force = study.parameters.size();
  const std::vector<model::Parameter> forces = smooth_forces(study.protocol);
  study.parameters.insert(study.parameters.end(), forces.begin(), forces.end());
  for (const trial::Trial& trial : rig.trials) study.cameras.push_back(trial.camera);
  study.groups = group_trials(rig, trials);
  study.base = model::usual_coordinates(study.parameters);
  begin_with_measured(study, trials);
  if (options.base_fit) out.base_fit = *options.base_fit;
  else out.base_fit = fit_base_with_clock(trials, study, options);
  BaseFit& fit = out.base_fit;
  for (const Index row : rows_of_clock(study))
    if (const auto found = fit.clock.find(study.parameters[static_cast<size_t>(row)].name); found != fit.clock.end())
      study.base(row) = found->second;
  if (!found_with_base(study).empty()) base = model::only(study.parameters, rows_of_base(study), study.base);
  if (fit.cells == 0) fit.cells = usual_cells(study.protocol, trials, base, fit.coordinates);
  study.protocol.cells = fit.cells;
  trials = looked_at_on(fit.cells, study.protocol, study.measured, trials);
  study.base.head(fit.coordinates.size()) = near_usual(study.protocol, base, fit.coordinates);
  const auto simulation_on = [&](long n) { return std::make_shared<const model::Simulation>(trials, on_grid_of(n)); };
  study.simulation = simulation_on(fit.cells);
  study.state = study.simulation->state_at(base, fit.coordinates);
  if (!fit.branch.empty()) study.simulation->take_branches(study.state, fit.branch);
  fit.branch = study.state.branch;
  study.simulation->lead_in(study.state, study.parameters, study.base);
  study.fine = simulation_on(std::lround(study.protocol.finer * static_cast<double>(fit.cells)));
  study.coarse = simulation_on(coarser_cells(study.protocol, fit.cells));
  options.progress(1, fmt::format("{} cells along the width", fit.cells));
  return out;
}

}  // namespace selvedge::diagnose
