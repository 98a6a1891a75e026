// A simulator that takes the place of our own sheet of splines in a fit: another program's, as a rule
// (station/simulator/).
//
// It is asked where points of the fabric are at the wanted times, and answers with control points of a sheet of splines
// through them, so that all that comes after a run (what cameras and trackers see, pictures, errors) is the same for
// every simulator. Values of its parameters stand in cloth::Experiment::simulator_values; materials, guides and air of
// an experiment are our own sheet's alone.
#pragma once

#include <string>
#include <vector>

#include "cloth/spline/simulate.h"
#include "model/parameter.h"

namespace selvedge::model {

class Simulator {
 public:
  virtual ~Simulator() = default;

  virtual std::string name() const = 0;
  // One line: what would make it another simulator. Part of the hash of what a fit rests on.
  virtual std::string identity() const = 0;
  // Fitted in the place of base_parameters().
  virtual std::vector<Parameter> parameters() const = 0;
  // Whether it seeks equilibrium from Experiment::start_shape, and begins a motion there where starts_at_rest is false.
  // Otherwise every run hangs by itself to begin with, on whatever branch.
  virtual bool begins_at_shapes() const = 0;
  // As cloth::spline::simulate; a sample at start_s alone is the equilibrium. Any thread may call. Throws BadInput
  // where the simulator does not keep to its protocol.
  virtual std::vector<cloth::Trajectory> simulate(const cloth::spline::SplineSheet& sheet,
                                                  const std::vector<cloth::Experiment>& lanes) const = 0;
  // Why the last run that diverged did, in its own words; empty: none.
  virtual std::string last_divergence() const = 0;
};

}  // namespace selvedge::model
