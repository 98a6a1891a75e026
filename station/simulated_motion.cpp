#include "station/simulated_motion.h"

#include <nlohmann/json.hpp>

#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::vector<double> shown_times(const trial::Trial& trial) {
  if (trial.frames) return trial.frames->time_s;
  std::vector<double> times;
  if (trial.markers)
    for (const double t : trial.markers->time_s)
      if (times.empty() || t > times.back()) times.push_back(t);
  return times;
}

void write_one(const SimulatedCampaign& s, size_t index, const trial::Trial& trial, const fs::path& folder) {
  const model::ObservedTrial& observed = s.simulation.trials()[index];
  const cloth::Trajectory run = s.simulation.trajectory(s.state, s.parameters, s.coordinates, index);
  if (!run.finite) return;
  const geometry::TriangleMesh& mesh = s.simulation.view().mesh();
  json uv = json::array();
  for (const Eigen::Vector2d& p : mesh.rest_uv) uv.push_back({p.x(), p.y()});
  std::vector<double> times;
  std::string bytes;
  for (const double t : shown_times(trial)) {
    if (t < observed.experiment.start_s) continue;
    if (!observed.still && t > observed.experiment.sample_s.back()) break;
    const Eigen::Matrix3Xf x = s.simulation.view().of(model::position_at(observed.experiment, run, t)).cast<float>();
    times.push_back(t);
    bytes.append(reinterpret_cast<const char*>(x.data()), sizeof(float) * static_cast<size_t>(x.size()));
  }
  const fs::path path = motion_path(folder, trial.name);
  files::write_whole(fs::path(path).replace_extension(".f32"), bytes);
  files::write_json(
      path,
      {{"format", "motion/1"}, {"trial", trial.name}, {"uv_m", uv}, {"triangles", mesh.triangles}, {"time_s", times}});
}

}  // namespace

void write_simulated_motions(const SimulatedCampaign& simulated, const trial::Campaign& campaign,
                             const fs::path& folder) {
  fs::create_directories(folder / "simulated");
  for (size_t i = 0; i < campaign.trials.size(); ++i) write_one(simulated, i, campaign.trials[i], folder);
}

void write_simulated_motions(const fit::FitOutcome& outcome, const trial::Campaign& campaign, const fs::path& folder) {
  std::vector<model::Parameter> parameters;
  for (const fit::FittedParameter& p : outcome.parameters) parameters.push_back(p.parameter);
  write_simulated_motions({*outcome.simulation, outcome.state, parameters, outcome.coordinates}, campaign, folder);
}

}  // namespace selvedge::station
