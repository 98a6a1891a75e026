// One thing that a base model may lack: what it adds to a prediction, and how large a change is worth trying.
//
// An effect is one file, NAME.cpp, with one function `Effect NAME()`; library.h lists them all. Its parameters are
// those of a fit (model/parameter.h): unit, neutral value (start), bounds, and scale, the finite size at which it is
// screened. Friction and slip are one-sided: their lower bound is the neutral value.
#pragma once

#include <string>
#include <vector>

#include "model/parameter.h"

namespace selvedge::diagnose {

enum class Side { measurement, boundary, elastic, dissipative, aerodynamic, inertial, numerical };
const char* to_text(Side side);

// What the effect is tried on.
enum class AppliesTo {
  anything,
  images,       // what a camera sees: trials with markers or scanned surfaces alone say nothing of it
  points,       // tracked points
  places,       // what is seen in the tracker's frame: points, scanned surfaces; a rig's pictures are calibrated in it
  distances,    // the same, where it is known from where it was seen
  outlines,     // a seen outline: images, scanned surfaces, or markers that are nodes of a grid inside one
  grids,        // markers that are nodes of a grid inside an outline
  simple_drag,  // base models whose drag is linear or none
};

// Where it is known from how it changes a residual.
enum class Change : char {
  simulated,
  of_grid,  // as what a finer grid adds
  of_mass   // motion stays if mass, stiffness, damping and drag grow alike: as the base does, the other way
};

struct Effect {
  std::string name;  // of the exchange format
  Side side = Side::elastic;
  std::string summary;  // one line: what would be so
  std::vector<model::Parameter> parameters;
  AppliesTo applies_to = AppliesTo::anything;
  // Further starting points beside neutral + scale of each parameter, as values: where the prediction depends on
  // a parameter only once another is not neutral (the place of a weight).
  std::vector<std::vector<double>> starts = {};
  bool starts_add = false;  // it may be there as a sum of them
  // Of its parameter's value: as how much of the effect another form of a law shows, where nothing is missing.
  double form = 0;
  Change change = Change::simulated;
};

// A parameter of an effect: acts linearly on its value, neutral at `neutral`.
model::Parameter effect_parameter(const std::string& name, const std::string& unit, double neutral, double lower,
                                  double upper, double scale, std::function<void(model::Prediction&, double)> apply);

// The same for one member of the material.
model::Parameter material_parameter(const std::string& name, const std::string& unit, double neutral, double lower,
                                    double upper, double scale, double cloth::Material::*member);

// The same parameter, of which how the fabric hangs before it moves is known not to depend.
model::Parameter of_motion(model::Parameter parameter);

}  // namespace selvedge::diagnose
