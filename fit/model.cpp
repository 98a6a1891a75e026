#include "fit/model.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace selvedge::fit {

namespace {

Parameter material(const std::string& name, const std::string& unit, double start, double lower, double upper,
                   double cloth::Material::*member) {
  return {name,  unit, start, lower,
          upper, true, 1,     [member](Prediction& p, double value) { p.experiment.material.*member = value; }};
}

}  // namespace

const char* to_text(Drag drag) {
  return drag == Drag::nonlinear ? "nonlinear_drag" : drag == Drag::linear ? "linear_drag" : "no_drag";
}

Drag drag_named(const std::string& text) {
  for (const Drag drag : {Drag::nonlinear, Drag::linear, Drag::none})
    if (text == to_text(drag)) return drag;
  throw std::invalid_argument("drag_named: found " + text);
}

std::vector<Parameter> base_parameters(Drag drag) {
  using M = cloth::Material;
  std::vector<Parameter> all = {
      material("stretch", "N/m", 120, 10, 5000, &M::stretch),
      material("shear", "N/m", 50, 3, 5000, &M::shear),
      material("bend", "N·m", 4e-5, 1e-7, 1e-2, &M::bend),
      material("stretch_damping", "N·s/m", 0.03, 1e-3, 0.3, &M::stretch_damping),
      material("shear_damping", "N·s/m", 0.03, 1e-3, 0.3, &M::shear_damping),
      material("bend_damping", "N·m·s", 3e-7, 1e-9, 1e-5, &M::bend_damping),
  };
  if (drag == Drag::nonlinear) {
    all.push_back(material("drag_normal", "kg/m³", 0.8, 0.02, 20, &M::drag_normal));
    all.push_back(material("drag_tangent", "kg/(m²·s)", 0.05, 1e-3, 5, &M::drag_tangent));
    all.push_back(material("drag_fade", "s²/m²", 0.2, 1e-2, 20, &M::drag_fade));
  } else if (drag == Drag::linear) {
    all.push_back(material("drag_linear", "kg/(m²·s)", 0.3, 1e-3, 20, &M::drag_linear));
    all.push_back(material("drag_tangent", "kg/(m²·s)", 0.05, 1e-3, 5, &M::drag_tangent));
  }
  for (size_t k = 3; k < all.size(); ++k) all[k].at_rest = false;  // damping and drag
  // What is not fitted is not there: a base without a drag law has no drag of the default material either.
  for (Parameter& p : all) {
    const auto inner = p.apply;
    p.apply = [inner, drag](Prediction& prediction, double value) {
      cloth::Material& m = prediction.experiment.material;
      if (drag != Drag::nonlinear) m.drag_normal = m.drag_fade = 0;
      if (drag == Drag::none) m.drag_tangent = m.drag_linear = 0;
      inner(prediction, value);
    };
  }
  return all;
}

std::vector<Parameter> only(const std::vector<Parameter>& parameters, const std::vector<Eigen::Index>& rows,
                            const Eigen::VectorXd& coordinates) {
  std::vector<Parameter> some;
  for (const Eigen::Index row : rows) some.push_back(parameters[static_cast<size_t>(row)]);
  for (size_t k = 0; k < parameters.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    if (std::find(rows.begin(), rows.end(), at) != rows.end()) continue;
    const auto held = parameters[k].apply, inner = some.front().apply;
    some.front().apply = [held, inner, value = to_value(parameters[k], coordinates(at))](Prediction& p, double x) {
      held(p, value);
      inner(p, x);
    };
  }
  return some;
}

double to_value(const Parameter& parameter, double coordinate) {
  return parameter.logarithmic ? std::exp(coordinate) : coordinate * parameter.scale;
}

double to_coordinate(const Parameter& parameter, double value) {
  return parameter.logarithmic ? std::log(value) : value / parameter.scale;
}

Eigen::VectorXd usual_coordinates(const std::vector<Parameter>& parameters) {
  Eigen::VectorXd x(static_cast<Eigen::Index>(parameters.size()));
  for (size_t k = 0; k < parameters.size(); ++k)
    x(static_cast<Eigen::Index>(k)) = to_coordinate(parameters[k], parameters[k].start);
  return x;
}

std::pair<Eigen::VectorXd, Eigen::VectorXd> bounds_of(const std::vector<Parameter>& parameters) {
  const auto count = static_cast<Eigen::Index>(parameters.size());
  std::pair<Eigen::VectorXd, Eigen::VectorXd> bounds{Eigen::VectorXd(count), Eigen::VectorXd(count)};
  for (Eigen::Index k = 0; k < count; ++k) {
    const Parameter& p = parameters[static_cast<size_t>(k)];
    bounds.first(k) = to_coordinate(p, p.lower);
    bounds.second(k) = to_coordinate(p, p.upper);
  }
  return bounds;
}

}  // namespace selvedge::fit
