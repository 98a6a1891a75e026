// `./selvedge prove spline-fit`: what the grid alone makes of parameters. Fabrics drawn from real ones are simulated on
// four times the cells that a fit chooses, and fitted. Fabrics come from ../shared; without it the proof is one figure
// that says so.
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

namespace selvedge::cli {

namespace {

// Of what the base model has; it knows neither anisotropy nor softening.
cloth::Material as_the_base_model(cloth::Material m) {
  m.bend_anisotropy = m.bend_stiffening = m.stretch_anisotropy = m.coupling = 0;
  return m;
}

struct FittedFabric {
  fit::FitOutcome outcome;
  cloth::Material truth;
  double off_percent(const std::string& name) const {
    for (const fit::FittedParameter& p : outcome.parameters)
      if (p.parameter.name == name)
        return 100 * std::abs(p.value / (truth.*cloth::material_parameter(name).member) - 1);
    return std::nan("");
  }
};

FittedFabric fit_fabric(const cloth::Material& material, const FigureOptions& options, double from, double to) {
  SimulatedSwatch swatch;
  swatch.material = material;
  swatch.noise_m = 1e-5;
  const double cell_m = cloth::spline::bending_length_m(material);
  swatch.cells = options.quick ? 12 : 2 * std::max(10, static_cast<int>(std::ceil(std::sqrt(2.0) * 0.3 / cell_m)));
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
  how.hold_out = fit::HoldOut::trials;
  if (options.quick) {
    how.cells = 8;
    how.coarse_cells = 6;
    how.max_iterations = 3;
  }
  how.progress = [&](double done, const std::string& what) { options.progress(from + (to - from) * done, what); };
  return {fit::fit_campaign(campaign, how), material};
}

}  // namespace

std::vector<Figure> prove_spline_fit(const FigureOptions& options) {
  const int count = options.quick ? 1 : 8;
  const auto fabrics = draw_real_fabrics(count, options.seed);
  if (!fabrics)
    return {{"SKIPPED: ../shared/real/bending/fabrics.csv is not there, no fabric was fitted", 0, 0, "",
             Relation::shown, "real fabrics"}};
  const std::vector<std::pair<std::string, double>> asked = {{"bend", 1}, {"stretch", 3}, {"shear", 3}};
  std::map<std::string, std::vector<double>> off;
  std::vector<Figure> out;
  for (int k = 0; k < count; ++k) {
    const DrawnFabric& drawn = (*fabrics)[static_cast<size_t>(k)];
    const FittedFabric f =
        fit_fabric(as_the_base_model(drawn.material), options, k / double(count), (k + 1) / double(count));
    const std::string what =
        fmt::format("{}, bending length {:.1f} mm, fitted on {} cells: ", drawn.name,
                    1e3 * cloth::spline::bending_length_m(f.truth), f.outcome.simulation->options().cells);
    for (const auto& [name, percent] : asked) {
      off[name].push_back(f.off_percent(name));
      out.push_back({what + name + " off", off[name].back(), percent, "%", Relation::shown, "asked"});
    }
    out.push_back({what + "held-out error", fit::held_out_mm(f.outcome), 0, "mm rms", Relation::shown, ""});
    out.push_back({what + "wall time", f.outcome.wall_s, 0, "s", Relation::shown, ""});
  }
  for (const auto& [name, percent] : asked)
    out.push_back({fmt::format("{} fabrics: {} off, median", count, name), median(off[name]), percent, "%",
                   options.quick ? Relation::shown : Relation::at_most, "asked"});
  options.progress(1, "done");
  return out;
}

}  // namespace selvedge::cli
