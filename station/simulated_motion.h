// Simulates each trial of a fit once more and keeps its motion beside the fit (motion_file.h).
#pragma once

#include <filesystem>

#include "capture/trial/trial.h"
#include "fit/fit_campaign.h"
#include "station/motion_file.h"

namespace selvedge::station {

// A simulation of a campaign at these parameters.
struct SimulatedCampaign {
  const model::Simulation& simulation;
  const model::State& state;
  const std::vector<model::Parameter>& parameters;
  const Eigen::VectorXd& coordinates;
};

// Below FOLDER, of each trial.
void write_simulated_motions(const SimulatedCampaign& simulated, const trial::Campaign& campaign,
                             const std::filesystem::path& folder);
void write_simulated_motions(const fit::FitOutcome& outcome, const trial::Campaign& campaign,
                             const std::filesystem::path& folder);

}  // namespace selvedge::station
