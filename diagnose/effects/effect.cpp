#include "diagnose/effects/effect.h"

namespace selvedge::diagnose {

const char* to_text(Side side) {
  switch (side) {
    case Side::measurement: return "measurement";
    case Side::boundary: return "boundary";
    case Side::elastic: return "elastic";
    case Side::dissipative: return "dissipative";
    case Side::aerodynamic: return "aerodynamic";
    case Side::inertial: return "inertial";
    case Side::numerical: return "numerical";
  }
  return "";
}

model::Parameter effect_parameter(const std::string& name, const std::string& unit, double neutral, double lower,
                                  double upper, double scale, std::function<void(model::Prediction&, double)> apply) {
  constexpr double kPriorSd = 20;  // in scales: it bounds what nothing determines
  model::Parameter p;
  p.name = name;
  p.unit = unit;
  p.start = neutral;
  p.lower = lower;
  p.upper = upper;
  p.logarithmic = false;
  p.scale = scale;
  p.apply = std::move(apply);
  p.prior_sd = kPriorSd;
  return p;
}

model::Parameter material_parameter(const std::string& name, const std::string& unit, double neutral, double lower,
                                    double upper, double scale, double cloth::Material::*member) {
  return effect_parameter(name, unit, neutral, lower, upper, scale,
                          [member](model::Prediction& p, double value) { p.experiment.material.*member = value; });
}

model::Parameter of_motion(model::Parameter parameter) {
  parameter.at_rest = false;
  return parameter;
}

}  // namespace selvedge::diagnose
