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

namespace selvedge::fit {

// How the simulated fabric is seen.
struct Seeing {
  double delay_s = 0;      // observations stamped t show the fabric at t − delay
  double drift = 0;        // s/s: the delay grows by this much a second of the recording
  double row_delay_s = 0;  // a rolling shutter: the last row is seen this much after the first
  Eigen::Vector3d projector_shift_m = Eigen::Vector3d::Zero();  // the projector moved by this since calibration
  double radial_distortion = 0;                                 // added to the camera's k1
};

struct Prediction {
  cloth::Experiment experiment;
  Seeing seeing;
  double beyond_mesh = 0;  // share of Objective's mesh correction that is added once more
};

struct Parameter {
  std::string name, unit;
  double start = 0;             // neutral value of an effect, or the usual value of a base parameter
  double lower = 0, upper = 0;  // bounds
  bool logarithmic = true;      // fitted as ln(value); else as value / scale
  double scale = 1;             // a change of the value that matters, for those that are not logarithmic
  std::function<void(Prediction&, double value)> apply;
  bool at_rest = true;  // false: it acts on motion alone, where the fabric hangs does not depend on it
};

// The base model: names and units of the exchange format. Mass is taken from the trial.
// drag "nonlinear" (Bhat et al. 2003), "linear", or "none".
enum class Drag { nonlinear, linear, none };
const char* to_text(Drag drag);  // nonlinear_drag, linear_drag, no_drag
// Throws std::invalid_argument where the text is none of these.
Drag drag_named(const std::string& text);
std::vector<Parameter> base_parameters(Drag drag = Drag::nonlinear);

// Those of the rows alone; the others stay at these coordinates.
std::vector<Parameter> only(const std::vector<Parameter>& parameters, const std::vector<Eigen::Index>& rows,
                            const Eigen::VectorXd& coordinates);

// From the fitted coordinate (ln or plain) to the value and back.
double to_value(const Parameter& parameter, double coordinate);
double to_coordinate(const Parameter& parameter, double value);

// Coordinates of the parameters' usual (or neutral) values, and of their lower and upper bounds.
Eigen::VectorXd usual_coordinates(const std::vector<Parameter>& parameters);
std::pair<Eigen::VectorXd, Eigen::VectorXd> bounds_of(const std::vector<Parameter>& parameters);

}  // namespace selvedge::fit
