// `./selvedge prove spline-fit`: what the grid alone makes of parameters, and what the size of a grip does. Fabrics
// drawn from real ones are simulated on a finer grid than a fit chooses, and fitted; a knit is simulated with
// other grips than the fit takes. Fabrics come from ../shared; without it the first part is one figure that says so.
#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/real_fabrics.h"
#include "cli/verify/proofs/simulated_trial.h"
#include "cloth/spline/chosen_grid.h"
#include "cloth/material_parameters.h"
#include "fit/fit_campaign.h"
#include "model/trial_error.h"

namespace selvedge::cli {

namespace {

// Of what the base model has; it knows neither anisotropy nor softening nor stiffening.
cloth::Material as_the_base_model(cloth::Material m) {
  m.bend_anisotropy = m.bend_stiffening = m.stretch_anisotropy = m.stretch_stiffening = m.coupling = 0;
  return m;
}

struct FittedFabric {
  fit::FitOutcome outcome;
  cloth::Material truth;
  int reference_cells = 0;

  const fit::FittedParameter& parameter(const std::string& name) const {
    return *std::find_if(outcome.parameters.begin(), outcome.parameters.end(),
                         [&](const fit::FittedParameter& p) { return p.parameter.name == name; });
  }
  double off_percent(const std::string& name, double fit::FittedParameter::*of = &fit::FittedParameter::value) const {
    return 100 * (parameter(name).*of / (truth.*cloth::material_parameter(name).member) - 1);
  }
  // Of the trial that is fitted worst.
  double error_mm() const {
    double most = 0;
    for (const fit::TrialError& t : outcome.trials) most = std::max(most, t.end_mm);
    return most;
  }
  // By which that many per cent of a parameter move the trial that they move most, root mean square.
  double moved_mm(const std::string& name, double percent) const {
    std::vector<model::Parameter> all;
    Eigen::Index row = 0;
    for (const fit::FittedParameter& p : outcome.parameters) {
      if (p.parameter.name == name) row = static_cast<Eigen::Index>(all.size());
      all.push_back(p.parameter);
    }
    Eigen::MatrixXd sets = outcome.coordinates.replicate(1, 2);
    sets(row, 1) = model::to_coordinate(parameter(name).parameter, (1 + percent / 100) * parameter(name).value);
    const model::Simulation& simulation = *outcome.simulation;
    const std::vector<model::Residuals> found = simulation.evaluate(outcome.state, all, sets);
    double most = 0;
    for (size_t i = 0; i < simulation.trials().size(); ++i)
      most =
          std::max(most, model::rms_mm(simulation.trials()[i], found[1].mm[i] - found[0].mm[i], simulation.time_s(i)));
    return most;
  }
  std::string interval(const std::string& name) const {
    return fmt::format("90 % from {:+.1f} to {:+.1f} %", off_percent(name, &fit::FittedParameter::lower_interval),
                       off_percent(name, &fit::FittedParameter::upper_interval));
  }
};

// The world has four times the cells of the first grid that a fit may go on to, at most so many along the width.
constexpr int kMostOfWorld = 64;

FittedFabric fit_fabric(const cloth::Material& material, double grip_m, const FigureOptions& options, double from,
                        double to) {
  SimulatedSwatch swatch;
  swatch.grip_m = grip_m;
  swatch.material = material;
  swatch.noise_m = 1e-5;
  const double cell_m = cloth::spline::bending_length_m(material);
  swatch.cells =
      options.quick ? 12 : std::clamp(2 * static_cast<int>(std::ceil(std::sqrt(2.0) * 0.3 / cell_m)), 20, kMostOfWorld);
  trial::Campaign campaign;
  campaign.folder = "simulated";
  const int samples = options.quick ? 40 : 110;
  campaign.trials = {
      simulated_trial(swatch, {.half_apart_m = 0.125, .samples = 12}, "static-1", options.seed),
      simulated_trial(swatch, {.half_apart_m = 0.125, .amplitude_m = 0.09, .frequency_hz = 1.4, .samples = samples},
                      "waving-1", options.seed + 1),
      simulated_trial(swatch, {.half_apart_m = 0.13, .amplitude_m = 0.06, .frequency_hz = 2, .samples = samples},
                      "waving-2", options.seed + 2)};
  fit::FitOptions how;
  how.hold_out = fit::HoldOut::none;
  if (options.quick) {
    how.cells = 8;
    how.coarse_cells = 6;
    how.max_iterations = 3;
  }
  how.progress = [&](double done, const std::string& what) { options.progress(from + (to - from) * done, what); };
  return {fit::fit_campaign(campaign, how), material, swatch.cells};
}

const std::vector<std::pair<std::string, double>> kAsked = {{"bend", 1}, {"stretch", 3}, {"shear", 3}};  // %

void add_drawn_fabrics(const FigureOptions& options, double share, std::vector<Figure>& out) {
  const int count = options.quick ? 1 : 5;
  const auto fabrics = draw_real_fabrics(count, options.seed);
  if (!fabrics) {
    out.push_back({"SKIPPED: ../shared/real/bending/fabrics.csv is not there, no real fabric was fitted", 0, 0, "",
                   Relation::shown, "real fabrics"});
    return;
  }
  std::map<std::string, std::vector<double>> off;
  for (int k = 0; k < count; ++k) {
    const DrawnFabric& drawn = (*fabrics)[static_cast<size_t>(k)];
    const FittedFabric f = fit_fabric(as_the_base_model(drawn.material), cloth::spline::Swatch().grip_m, options,
                                      share * k / count, share * (k + 1) / count);
    const std::string what = fmt::format(
        "{}, bending length {:.1f} mm, simulated on {} cells, fitted on {}: ", drawn.name,
        1e3 * cloth::spline::bending_length_m(f.truth), f.reference_cells, f.outcome.simulation->options().cells);
    std::string told = what;
    for (const auto& [name, percent] : kAsked) {
      off[name].push_back(std::abs(f.off_percent(name)));
      out.push_back({what + name + " off", f.off_percent(name), percent, "%", Relation::shown, f.interval(name)});
      const double moved_mm = f.moved_mm(name, percent);
      out.push_back({fmt::format("{}what {} % of {} move", what, percent, name), moved_mm, f.error_mm(), "mm rms",
                     Relation::shown, "error of the trial that is fitted worst"});
      told += fmt::format("{} {:+.2f} % ({}; {} % move {:.3f} mm), ", name, f.off_percent(name), f.interval(name),
                          percent, moved_mm);
    }
    out.push_back({what + "error of the trial that is fitted worst", f.error_mm(), f.outcome.grid_mm, "mm rms",
                   Relation::shown, "moved by the next finer grid"});
    out.push_back({what + "wall time", f.outcome.wall_s, 0, "s", Relation::shown, ""});
    told += fmt::format("{:.2f} mm, {:.0f} s", f.error_mm(), f.outcome.wall_s);
    for (const std::string& remark : f.outcome.remarks) told += "; " + remark;
    options.tell(told);
  }
  for (const auto& [name, percent] : kAsked)
    out.push_back({fmt::format("{} fabrics: {} off, median", count, name), median(off[name]), percent, "%",
                   options.quick ? Relation::shown : Relation::at_most, "asked"});
  for (const auto& [name, percent] : kAsked)
    out.push_back({fmt::format("{} fabrics: {} off, worst", count, name),
                   *std::max_element(off[name].begin(), off[name].end()), percent, "%", Relation::shown, "asked"});
}

// A fit takes a grip of 7.5 mm; the rig's may be another.
void add_grips(const FigureOptions& options, double from, std::vector<Figure>& out) {
  const std::vector<double> grips_mm = options.quick ? std::vector<double>{10} : std::vector<double>{4, 7.5, 12};
  for (size_t k = 0; k < grips_mm.size(); ++k) {
    const double each = (1 - from) / static_cast<double>(grips_mm.size()), at = from + each * static_cast<double>(k);
    const FittedFabric f = fit_fabric(proof_fabric(), 1e-3 * grips_mm[k], options, at, at + each);
    std::string told = fmt::format("grips of {} mm: ", grips_mm[k]);
    const std::string what = fmt::format("a knit held by grips of {} mm, fitted with 7.5: ", grips_mm[k]);
    for (const auto& [name, percent] : kAsked) {
      out.push_back({what + name + " off", f.off_percent(name), 0, "%", Relation::shown, f.interval(name)});
      told += fmt::format("{} {:+.2f} %, ", name, f.off_percent(name));
    }
    options.tell(told + fmt::format("{:.2f} mm, {:.0f} s", f.error_mm(), f.outcome.wall_s));
    out.push_back({what + "error of the trial that is fitted worst", f.error_mm(), 0, "mm rms", Relation::shown, ""});
  }
}

}  // namespace

std::vector<Figure> prove_spline_fit(const FigureOptions& options) {
  std::vector<Figure> out;
  add_drawn_fabrics(options, 0.75, out);
  add_grips(options, 0.75, out);
  options.progress(1, "done");
  return out;
}

}  // namespace selvedge::cli
