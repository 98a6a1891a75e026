#include "evaluation/fresh_reduction.h"

#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "diagnose/ahead.h"
#include "diagnose/verdict.h"
#include "model/simulation.h"
#include "model/trial_error.h"
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

// Of each trial, running free.
VectorXd free_mm(const model::Simulation& simulation, const model::State& state, const Arm& arm) {
  const model::Residuals r = simulation.evaluate(state, arm.parameters, arm.coordinates).front();
  VectorXd mm = VectorXd::Constant(static_cast<Index>(r.mm.size()), std::numeric_limits<double>::quiet_NaN());
  for (size_t i = 0; r.finite && i < r.mm.size(); ++i)
    mm(static_cast<Index>(i)) = model::rms_mm(simulation.trials()[i], r.mm[i], simulation.time_s(i));
  return mm;
}

}  // namespace

FreshReduction reduction_on(const trial::Campaign& fresh, const std::vector<diagnose::Effect>& effects,
                            const nlohmann::json& diagnosis, const std::string& hypothesis, int cells) {
  const std::vector<model::ObservedTrial> trials =
      fit::observe_campaign(fresh, 30, 10, [](double, const std::string&) {});
  model::SimulationOptions options;
  options.cells = cells;
  const bool is_ahead = diagnosis.at("shrink").at(hypothesis).contains("ahead_s");
  const nlohmann::json& fitted = diagnosis.at(is_ahead ? "fit" : "free_fit");
  const model::Drag drag = model::drag_named(diagnosis.at("base").get<std::string>());
  VectorXd count(static_cast<Index>(trials.size())), noise_mm(static_cast<Index>(trials.size()));
  for (size_t i = 0; i < trials.size(); ++i) {
    const auto& markers = trials[i].markers;
    count(static_cast<Index>(i)) = markers ? static_cast<double>(markers->position.array().isFinite().count()) : 0;
    noise_mm(static_cast<Index>(i)) = markers ? diagnose::marker_noise_mm(trials[i]) : 0;
  }
  const auto pooled = [&](const VectorXd& mm) { return std::sqrt(count.dot(mm.cwiseAbs2()) / count.sum()); };
  const auto error_mm = [&](const nlohmann::json& values) {
    const Arm arm = arm_of(values, drag, effects);
    const model::Simulation simulation(trials, options);
    const model::State state = simulation.state_at(arm.parameters, arm.coordinates);
    return pooled(
        is_ahead
            ? VectorXd(
                  diagnose::ahead_mm(simulation, state, diagnose::Protocol{}, arm.parameters, arm.coordinates).row(0))
            : free_mm(simulation, state, arm));
  };
  return {error_mm(fitted.at("none")), error_mm(fitted.at(hypothesis)), pooled(noise_mm)};
}

}  // namespace selvedge::evaluation
