// `./selvedge bench fit`: one waving trial of 50 frames at 640×480, nine parameters, as `./selvedge fit` fits it: from
// reading the images and the coarse grid to the end.
#include <chrono>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "cli/verify/figures.h"
#include "experiments/simulated_trials.h"
#include "files/shared_files.h"
#include "fit/fit_campaign.h"

namespace selvedge::cli {

std::vector<Figure> bench_fit(const FigureOptions& options) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() /
      fmt::format("selvedge_bench_fit_{}", std::chrono::steady_clock::now().time_since_epoch().count());
  const experiments::ExperimentFile file =
      experiments::read_experiment(files::shared_folder() / "examples" / "experiments" / "waving.toml");
  const experiments::Fabric knit = file.fabrics.back();
  experiments::TrialProtocol record = file.protocol;
  record.trials.resize(1);
  record.seed = options.seed;
  record.cells = options.quick ? 6 : 16;
  record.frames = options.quick ? 12 : 50;
  experiments::record_fabric(knit, record, folder);
  const trial::Campaign campaign = trial::read_campaign(folder / record.trials[0].name);

  fit::FitOptions fit_options;
  fit_options.progress = options.progress;
  if (options.quick) {
    fit_options.cells = 6;
    fit_options.coarse_cells = 5;
    fit_options.max_iterations = 4;
  }
  const fit::FitOutcome out = fit::fit_campaign(campaign, fit_options);
  std::filesystem::remove_all(folder);

  const auto value = [&](const char* name) {
    for (const fit::FittedParameter& p : out.parameters)
      if (p.parameter.name == name) return p.value;
    return std::nan("");
  };
  const cloth::Material truth = knit.material;
  const std::string what = fmt::format("{} frames of 640x480, nine parameters: ", record.frames);
  return {
      {what + "coarse start to end", out.wall_s, 15, "s", Relation::shown, "asked of two idle cores; the paper: 50 h"},
      {what + "simulations", double(out.evaluations), 600, "", Relation::shown, "the paper: about 600"},
      {what + "error at the coarse start", out.trials.front().start_mm, 0, "mm", Relation::shown, ""},
      {what + "error at the end", out.trials.front().end_mm, 1.04, "mm", Relation::shown, "that of triangles"},
      {what + "bend off", 100 * (value("bend") / truth.bend - 1), 5, "%", Relation::shown, "recorded on 16 cells"},
      {what + "stretch off", 100 * (value("stretch") / truth.stretch - 1), 5, "%", Relation::shown,
       "recorded on 16 cells"},
      {what + "drag_normal off", 100 * (value("drag_normal") / truth.drag_normal - 1), 5, "%", Relation::shown,
       "recorded on 16 cells"},
  };
}

}  // namespace selvedge::cli
