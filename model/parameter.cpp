#include "model/parameter.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "cloth/material_parameters.h"

namespace selvedge::model {

namespace {

// Whether a drag law has this parameter; what is not of drag belongs to all of them.
bool belongs_to(Drag drag, const std::string& name) {
  if (name == "drag_normal" || name == "drag_fade") return drag == Drag::nonlinear;
  if (name == "drag_linear") return drag == Drag::linear;
  return name != "drag_tangent" || drag != Drag::none;
}

// What is not fitted is not there: a base without a drag law has no drag of the default material either.
std::vector<double cloth::Material::*> other_drag(Drag drag) {
  std::vector<double cloth::Material::*> members;
  for (const cloth::MaterialParameter& row : cloth::material_parameters())
    if (!belongs_to(drag, row.name)) members.push_back(row.member);
  return members;
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
  std::vector<Parameter> all;
  const auto left_out = other_drag(drag);
  for (const cloth::MaterialParameter& row : cloth::material_parameters()) {
    if (!belongs_to(drag, row.name)) continue;
    Parameter& p = all.emplace_back();
    p.name = row.name;
    p.unit = row.unit;
    p.start = row.usual;
    p.lower = row.lower;
    p.upper = row.upper;
    p.apply = [left_out, member = row.member](Prediction& prediction, double value) {
      for (const auto other : left_out) prediction.experiment.material.*other = 0;
      prediction.experiment.material.*member = value;
    };
    p.at_rest = row.at_rest;
    p.prior_sd = row.prior_sd;
    p.shows_soon = row.shows_soon;
    p.tried = row.tried;
  }
  return all;
}

size_t place_of(const std::vector<Parameter>& parameters, const std::string& name) {
  const auto at =
      std::find_if(parameters.begin(), parameters.end(), [&](const Parameter& p) { return p.name == name; });
  return static_cast<size_t>(at - parameters.begin());
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

}  // namespace selvedge::model
