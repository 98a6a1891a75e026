#include "evaluation/fresh_reduction.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "diagnose/windows.h"
#include "model/simulation.h"
#include "fit/stages.h"

namespace selvedge::evaluation {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

struct Arm {
  std::vector<model::Parameter> parameters;
  VectorXd coordinates;
};

Arm arm_of(const nlohmann::json& values, model::Drag drag, const std::vector<diagnose::Effect>& effects) {
  Arm arm{model::base_parameters(drag), {}};
  for (const diagnose::Effect& e : effects)
    if (values.contains(e.parameters.front().name))
      arm.parameters.insert(arm.parameters.end(), e.parameters.begin(), e.parameters.end());
  arm.coordinates.resize(static_cast<Index>(arm.parameters.size()));
  for (size_t k = 0; k < arm.parameters.size(); ++k)
    arm.coordinates(static_cast<Index>(k)) =
        model::to_coordinate(arm.parameters[k], values.at(arm.parameters[k].name).get<double>());
  return arm;
}

}  // namespace

FreshReduction reduction_on(const trial::Campaign& fresh, const std::vector<diagnose::Effect>& effects,
                            const nlohmann::json& diagnosis, const std::string& hypothesis, int cells) {
  const diagnose::Protocol protocol;
  const std::vector<model::ObservedTrial> trials = fit::observe_campaign(
      fresh, protocol.rate_hz, protocol.image_rate_hz, [](double, const std::string&) {}, observe::Thinning::averaged);
  model::SimulationOptions options;
  options.cells = cells;
  const model::Simulation simulation(trials, options);
  const diagnose::Windows windows(simulation, protocol);
  const nlohmann::json& fitted = diagnosis.at("fit");
  const model::Drag drag = model::drag_named(diagnosis.at("base").get<std::string>());
  // Of markers in space.
  const auto mm = [](const VectorXd& rows) {
    return std::sqrt(3 * rows.squaredNorm() / static_cast<double>(rows.size()));
  };
  const auto error_mm = [&](const nlohmann::json& values) {
    const Arm arm = arm_of(values, drag, effects);
    const model::State state = simulation.state_at(arm.parameters, arm.coordinates);
    return mm(windows.residuals(simulation, state, arm.parameters, arm.coordinates).col(0));
  };
  return {error_mm(fitted.at("none")), error_mm(fitted.at(hypothesis)), mm(windows.noise_mm())};
}

}  // namespace selvedge::evaluation
