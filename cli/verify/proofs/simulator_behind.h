// Our own sheet as another simulator, in this process and behind `simulator/1`: the same fit twice.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "capture/trial/trial.h"
#include "cli/verify/proofs/simulated_trial.h"
#include "fit/fit_campaign.h"
#include "model/simulator.h"
#include "station/programs.h"
#include "station/simulator/foreign_simulator.h"

namespace selvedge::cli {

class OwnSheetHere : public model::Simulator {
 public:
  // off_m: each run begins beside where it is told to, for what rounding alone does to a fit.
  explicit OwnSheetHere(double off_m = 0) : off_m_(off_m) {}
  std::string name() const override { return "the sheet in this process"; }
  std::string identity() const override { return "here"; }
  std::vector<model::Parameter> parameters() const override { return model::base_parameters(); }
  bool begins_at_shapes() const override { return true; }
  std::vector<cloth::Trajectory> simulate(const cloth::spline::SplineSheet& sheet,
                                          const std::vector<cloth::Experiment>& told) const override {
    std::vector<cloth::Experiment> lanes = told;
    for (cloth::Experiment& lane : lanes) lane.start_shape.array() += off_m_;
    if (lanes.empty() || lanes.front().sample_s.size() > 1) return cloth::spline::simulate(sheet, lanes);
    std::vector<cloth::Trajectory> still;
    for (const cloth::Rest& rest : relax(sheet, lanes))
      still.push_back({{rest.position}, rest.position, rest.at_rest, rest.position.allFinite()});
    return still;
  }
  std::string last_divergence() const override { return "diverged"; }

 private:
  double off_m_ = 0;
};

inline std::shared_ptr<const model::Simulator> own_sheet_behind(const std::filesystem::path& log,
                                                                model::Drag drag = model::Drag::nonlinear) {
  return std::make_shared<station::ForeignSimulator>(
      "'" + station::program(station::kLabProgram).string() + "' simulator serve --base " + to_text(drag),
      station::ForeignOptions{log});
}

// A hang and waves of a knit as 25 markers saw them.
inline trial::Campaign campaign_behind(int waves, double seconds, unsigned seed) {
  trial::Campaign campaign;
  campaign.folder = "simulated";
  campaign.trials.push_back(simulated_trial({}, {}, "still", seed));
  for (int k = 0; k < waves; ++k)
    campaign.trials.push_back(simulated_trial(
        {.cells = 12},
        {.amplitude_m = 0.1, .frequency_hz = 1.2 + 0.4 * k, .samples = static_cast<int>(120 * seconds) + 1},
        "waved-" + std::to_string(k + 1), seed + 1 + static_cast<unsigned>(k)));
  return campaign;
}

inline fit::FitOptions fit_behind(int cells, std::shared_ptr<const model::Simulator> simulator) {
  fit::FitOptions options;
  options.cells = cells;
  options.hold_out = fit::HoldOut::none;
  options.simulator = std::move(simulator);
  return options;
}

}  // namespace selvedge::cli
