#include "diagnose/spots_seen.h"

#include <utility>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;

SpotsSeen::SpotsSeen(const model::Simulation& simulation, size_t trial, cloth::Experiment experiment,
                     cloth::Trajectory trajectory)
    : simulation_(&simulation), trial_(trial), experiment_(std::move(experiment)), trajectory_(std::move(trajectory)) {}

void SpotsSeen::at_time(double t_s) {
  position_ = simulation_->view().of(model::position_at(experiment_, trajectory_, t_s));
}

Vector2d SpotsSeen::uv(const observe::DepthPoint& p) const {
  const geometry::Projection& camera = simulation_->trials()[trial_].stripes->camera;
  return nearest((position_.colwise() - place_of(camera, p)).colwise().squaredNorm());
}

Vector2d SpotsSeen::uv(const observe::OutlinePoint& p) const {
  const geometry::Projection& camera = simulation_->trials()[trial_].stripes->camera;
  const Vector3d along = geometry::ray(camera, p.pixel);
  const Matrix3Xd from = position_.colwise() - geometry::centre(camera);
  return nearest((from - along * (along.transpose() * from)).colwise().squaredNorm());
}

Vector2d SpotsSeen::nearest(const Eigen::RowVectorXd& squared) const {
  Index at = 0;
  squared.minCoeff(&at);
  return simulation_->view().mesh().rest_uv[static_cast<size_t>(at)];
}

std::vector<SpotsSeen> spots_seen(const Study& study) {
  const model::Simulation& simulation = *study.simulation;
  std::vector<cloth::Experiment> lanes;
  for (size_t t = 0; t < simulation.trials().size(); ++t)
    lanes.push_back(simulation.predictions(study.state, study.parameters, study.base, t, 0, 1).front().experiment);
  std::vector<cloth::Experiment> seen;
  for (size_t t = 0; t < lanes.size(); ++t)
    if (simulation.trials()[t].stripes) seen.push_back(lanes[t]);
  std::vector<cloth::Trajectory> runs;
  if (!seen.empty()) runs = simulation.simulated(seen);
  std::vector<SpotsSeen> out;
  auto run = runs.begin();
  for (size_t t = 0; t < lanes.size(); ++t) {
    cloth::Trajectory none;
    none.finite = false;
    out.emplace_back(simulation, t, std::move(lanes[t]),
                     simulation.trials()[t].stripes ? std::move(*run++) : std::move(none));
  }
  return out;
}

}  // namespace selvedge::diagnose
