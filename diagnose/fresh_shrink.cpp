#include "diagnose/fresh_shrink.h"

#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "fit/objective.h"
#include "fit/stages.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

struct Arm {
  std::vector<fit::Parameter> parameters;
  VectorXd coordinates;
};

Arm arm_of(const nlohmann::json& values, fit::Drag drag, const std::vector<Effect>& effects) {
  Arm arm{fit::base_parameters(drag), {}};
  for (const Effect& e : effects)
    if (values.contains(e.parameters.front().name)) arm.parameters.insert(arm.parameters.end(), e.parameters.begin(), e.parameters.end());
  arm.coordinates.resize(static_cast<Index>(arm.parameters.size()));
  for (size_t k = 0; k < arm.parameters.size(); ++k)
    arm.coordinates(static_cast<Index>(k)) = fit::to_coordinate(arm.parameters[k], values.at(arm.parameters[k].name).get<double>());
  return arm;
}

}  // namespace

FreshShrink shrink_on(const trial::Campaign& fresh, const std::vector<Effect>& effects, const nlohmann::json& diagnosis, const std::string& hypothesis,
                      int columns) {
  const std::vector<fit::ObservedTrial> trials = fit::observe_campaign(fresh, 30, 10, [](double, const std::string&) {});
  fit::ObjectiveOptions free;
  free.columns = columns;
  const nlohmann::json& fitted = diagnosis.at("free_fit");
  const fit::Drag drag = fit::drag_named(diagnosis.at("base").get<std::string>());
  const auto error_mm = [&](const nlohmann::json& values) {
    const Arm arm = arm_of(values, drag, effects);
    const fit::Objective objective(trials, free, arm.parameters, arm.coordinates);
    const fit::Residuals r = objective.evaluate(arm.parameters, arm.coordinates).front();
    if (!r.finite) return std::numeric_limits<double>::quiet_NaN();
    double sum = 0, count = 0;
    for (size_t i = 0; i < trials.size(); ++i)
      for (const double mm : r.mm[i])
        if (std::isfinite(mm)) {
          sum += mm * mm;
          ++count;
        }
    return std::sqrt(3 * sum / std::max(count, 1.0));
  };
  FreshShrink out{error_mm(fitted.at("none")), error_mm(fitted.at(hypothesis)), 0};
  for (const fit::ObservedTrial& t : trials)
    if (t.markers) out.noise_mm = std::max(out.noise_mm, std::sqrt(3.0) * 1e3 * t.markers->noise_m);
  return out;
}

}  // namespace selvedge::diagnose
