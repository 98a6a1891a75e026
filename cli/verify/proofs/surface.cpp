// `./selvedge prove surface`: fabrics that a depth camera scanned, of points that are others at each time. They move on
// finer cells than the fit chooses.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/scanned_trial.h"
#include "diagnose/diagnosis.h"
#include "diagnose/effects/library.h"
#include "fit/campaign_search.h"
#include "fit/fit_campaign.h"
#include "fit/stages.h"
#include "report/progress.h"

namespace selvedge::cli {

namespace {

constexpr double kCameraNoise_m = 1.5e-3;
constexpr double kDelay_s = 0.02;

SimulatedSwatch swatch_of(double bending_length_m) {
  SimulatedSwatch c;
  c.material.density = 0.16;
  c.material.bend = std::pow(bending_length_m, 3) * c.material.density * 9.81;
  c.material.bend_damping = 1e-7;
  c.cells = static_cast<int>(std::ceil(1.4 * 0.3 / bending_length_m));
  return c;
}

const std::map<std::string, SimulatedMotion> kMotions = {
    {"static-1", {.half_apart_m = 0.125, .samples = 13}},
    {"waving-1", {.half_apart_m = 0.125, .amplitude_m = 0.1, .frequency_hz = 1.2, .samples = 145}},
    {"waving-2", {.half_apart_m = 0.125, .amplitude_m = 0.07, .frequency_hz = 1.8, .samples = 145}}};

// motions: the first ones of these.
trial::Campaign scanned(const SimulatedSwatch& c, const DepthCamera& camera, unsigned seed, size_t motions = 3) {
  trial::Campaign out;
  out.folder = "scanned";
  out.fabric = "test knit";
  for (const auto& [name, motion] : kMotions)
    if (out.trials.size() < motions) out.trials.push_back(scanned_trial(c, motion, camera, name, ++seed));
  return out;
}

// Between the fitted and the true motion of points all over the fabric, which nobody tracked, root mean square, mm.
double motion_error_mm(const fit::FitOutcome& out, const SimulatedSwatch& truth) {
  std::vector<model::Parameter> parameters;
  for (const fit::FittedParameter& p : out.parameters) parameters.push_back(p.parameter);
  double square = 0, count = 0;
  for (size_t t = 0; t < out.simulation->trials().size(); ++t) {
    const model::ObservedTrial& trial = out.simulation->trials()[t];
    if (trial.still) continue;
    const SimulatedRun run = simulated_run(truth, kMotions.at(trial.name), trial.name, 0);
    const cloth::Trajectory fitted = out.simulation->trajectory(out.state, parameters, out.coordinates, t);
    for (int i = 0; i < static_cast<int>(run.run.samples.size()); i += 8) {
      const Eigen::Matrix3Xd here = model::position_at(trial.experiment, fitted, i / 120.0), there = run.shape(i, 0);
      for (double u = 0.03; u < 0.3; u += 0.04)
        for (double v = 0.03; v < 0.3; v += 0.04) {
          square += (position_of(surface_point(out.simulation->sheet(), {u, v}), here) -
                     position_of(surface_point(run.sheet, {u, v}), there))
                        .squaredNorm();
          ++count;
        }
    }
  }
  return 1e3 * std::sqrt(square / count);
}

void fit_figures(double bending_length_m, const FigureOptions& options, const report::ProgressCallback& progress,
                 std::vector<Figure>& figures) {
  const SimulatedSwatch truth = swatch_of(bending_length_m);
  const DepthCamera camera{.noise_m = kCameraNoise_m, .px_apart_m = options.quick ? 5e-3 : 3e-3};
  fit::FitOptions how;
  how.progress = progress;
  if (options.quick) {
    how.coarse_cells = 8;
    how.max_iterations = 5;
  }
  const fit::FitOutcome out = fit_campaign(scanned(truth, camera, options.seed, options.quick ? 2 : 3), how);
  const std::string what = fmt::format("bending length {:.0f} mm: ", 1e3 * bending_length_m);
  for (const fit::FittedParameter& p : out.parameters) {
    const bool is_bend = p.parameter.name == "bend";
    if (!is_bend && p.parameter.name != "drag_normal") continue;
    const double true_value = is_bend ? truth.material.bend : truth.material.drag_normal;
    figures.push_back({what + p.parameter.name + " off by", 100 * std::abs(std::log(p.value / true_value)), 15, "%",
                       Relation::at_most, "what made the clouds"});
  }
  figures.push_back({what + "motion of points that nobody tracked off by", motion_error_mm(out, truth),
                     1e3 * kCameraNoise_m, "mm", Relation::at_most, "noise of one scanned point"});
  options.tell(fmt::format("{}{} simulations in {:.0f} s", what, out.evaluations, out.wall_s));
}

// Of an effect that did not make the clouds.
double most_of_others(const diagnose::Diagnosis& d, const std::string& made_it) {
  double most = 0;
  for (const auto& [name, inclusion] : d.inclusion)
    if (name != made_it) most = std::max(most, inclusion);
  return most;
}

diagnose::Diagnosis diagnosed(double delay_s, const FigureOptions& options, const report::ProgressCallback& progress) {
  const DepthCamera camera{.noise_m = kCameraNoise_m, .delay_s = delay_s};
  diagnose::DiagnosisOptions how;
  how.study.progress = progress;
  diagnose::Diagnosis d =
      diagnose::diagnose(scanned(swatch_of(0.018), camera, options.seed), diagnose::effect_library(), how);
  std::string answer = fmt::format("late by {:.0f} ms: {}", 1e3 * delay_s, d.cause);
  for (const auto& [name, probability] : d.probability)
    if (probability > 0.05) answer += fmt::format(", {} {:.2f}", name, probability);
  options.tell(fmt::format("{}; likeliest {}, p {:.2g}, {:.0f} s", answer, d.likeliest, d.p_value, d.wall_s));
  return d;
}

void delay_figures(const FigureOptions& options, std::vector<Figure>& figures) {
  const diagnose::Diagnosis late = diagnosed(kDelay_s, options, fit::part_of(options.progress, 0.4, 0.7, "late"));
  figures.push_back({"a camera that is late by 20 ms: probability of camera_delay", late.inclusion.at("camera_delay"),
                     0.5, "1", Relation::at_least, "what made the clouds"});
  figures.push_back({"most probable of what is not there", most_of_others(late, "camera_delay"), 0.5, "1",
                     Relation::at_most, "what made the clouds"});
  for (const diagnose::EffectFinding& f : late.effects) {
    if (f.name != "camera_delay" || f.size.empty()) continue;
    figures.push_back({"its delay off by", 1e3 * std::abs(f.size[0].value - kDelay_s), 4, "ms", Relation::at_most,
                       "what made the clouds"});
  }
  const diagnose::Diagnosis right = diagnosed(0, options, fit::part_of(options.progress, 0.7, 1, "not late"));
  figures.push_back({"a camera that is not: probability of none", right.probability.at("none"), 0.5, "1",
                     Relation::at_least, "what made the clouds"});
  figures.push_back({"what is left of held-out trials", right.before_mm, 1.2 * right.noise_floor_mm, "mm",
                     Relation::at_most, "its noise floor, and a fifth"});
}

}  // namespace

std::vector<Figure> prove_surface(const FigureOptions& options) {
  std::vector<Figure> figures;
  if (options.quick) {
    fit_figures(0.03, options, options.progress, figures);
    return figures;
  }
  fit_figures(0.022, options, fit::part_of(options.progress, 0, 0.2, "22 mm"), figures);
  fit_figures(0.018, options, fit::part_of(options.progress, 0.2, 0.4, "18 mm"), figures);
  delay_figures(options, figures);
  return figures;
}

}  // namespace selvedge::cli
