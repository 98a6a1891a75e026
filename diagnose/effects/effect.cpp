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

fit::Parameter effect_parameter(const std::string& name, const std::string& unit, double neutral, double lower,
                                double upper, double scale, std::function<void(fit::Prediction&, double)> apply) {
  return {name, unit, neutral, lower, upper, false, scale, std::move(apply)};
}

fit::Parameter material_parameter(const std::string& name, const std::string& unit, double neutral, double lower,
                                  double upper, double scale, double cloth::Material::*member) {
  return effect_parameter(name, unit, neutral, lower, upper, scale,
                          [member](fit::Prediction& p, double value) { p.experiment.material.*member = value; });
}

fit::Parameter of_motion(fit::Parameter parameter) {
  parameter.at_rest = false;
  return parameter;
}

}  // namespace selvedge::diagnose
