// What a fit may change: named parameters that act on a prediction.
//
// A prediction is plain data: the experiment that is simulated and how it is seen. The base model's parameters
// and every effect's parameters are of one kind, so that any set of them can be fitted together.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "cloth/simulate.h"
#include "observe/sensor_model.h"

namespace selvedge::model {

struct Prediction {
  cloth::Experiment experiment;
  observe::SensorModel sensor;
  double beyond_mesh = 0;  // share of State's grid correction that is added once more
};

struct Parameter {
  std::string name, unit;
  double start = 0;             // neutral value of an effect, or the usual value of a base parameter
  double lower = 0, upper = 0;  // bounds
  bool logarithmic = true;      // fitted as ln(value); else as value / scale
  double scale = 1;             // a change of the value that matters, for those that are not logarithmic
  std::function<void(Prediction&, double value)> apply;
  bool at_rest = true;             // false: it acts on motion alone, where the fabric hangs does not depend on it
  double prior_sd = 2.5;           // in coordinates
  bool shows_soon = false;         // the beginning of a motion determines it
  bool measured = false;           // start and prior_sd come from a test of the fabric: every fit is drawn to start
  std::vector<double> tried = {};  // by a coarse search; empty: none
};

// The base model: cloth/material_parameters.h, of drag those of one law. Mass is taken from the trial.
// drag "nonlinear" (Bhat et al. 2003), "linear", or "none".
enum class Drag { nonlinear, linear, none };
const char* to_text(Drag drag);  // nonlinear_drag, linear_drag, no_drag
// Throws std::invalid_argument where the text is none of these.
Drag drag_named(const std::string& text);
std::vector<Parameter> base_parameters(Drag drag = Drag::nonlinear);

// Where the parameter of this name stands; parameters.size() where there is none.
size_t place_of(const std::vector<Parameter>& parameters, const std::string& name);

// Those of the rows alone; the others stay at these coordinates.
std::vector<Parameter> only(const std::vector<Parameter>& parameters, const std::vector<Eigen::Index>& rows,
                            const Eigen::VectorXd& coordinates);

// From the fitted coordinate (ln or plain) to the value and back.
double to_value(const Parameter& parameter, double coordinate);
double to_coordinate(const Parameter& parameter, double value);

// Coordinates of the parameters' usual (or neutral) values, and of their lower and upper bounds.
Eigen::VectorXd usual_coordinates(const std::vector<Parameter>& parameters);
std::pair<Eigen::VectorXd, Eigen::VectorXd> bounds_of(const std::vector<Parameter>& parameters);

}  // namespace selvedge::model
