// The campaign under the base model, ready for questions: what was seen, its trials on the usual grid and on a finer
// one, and the fitted parameters of the base.
//
// All parameters, the base's, the effects' and the smooth forces', stand in one list. Coordinates of effects and forces
// are zero at neutral.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/trial/trial.h"
#include "diagnose/effects/effect.h"
#include "diagnose/measured.h"
#include "diagnose/protocol.h"
#include "geometry/projection.h"
#include "model/simulation.h"

namespace selvedge::diagnose {

struct Study {
  std::string campaign;
  Protocol protocol;
  double right_scale = protocol.right_scale;  // median of s (evidence.h) in a right model of what was recorded so
  std::vector<Effect> effects;
  std::vector<model::Parameter> parameters;  // base, then every effect's, then one a smooth force
  size_t base_count = 0, first_force = 0;
  std::vector<size_t> first_parameter;                       // of each effect
  std::vector<std::optional<geometry::Projection>> cameras;  // of each trial
  Measured measured;
  // Trials that are held out together: replicates, and all still ones that count.
  std::vector<std::vector<size_t>> groups;
  std::shared_ptr<const model::Simulation> simulation;
  model::State state;
  std::shared_ptr<const model::Simulation> coarse, fine;  // the same trials on other grids
  // Coordinates of all parameters, effects neutral but for what was measured before
  // any physics and for the clock that the base fit found.
  Eigen::VectorXd base;
  std::vector<std::string> remarks;  // what material tests gave the base
  std::vector<std::string> doubts;   // of the recordings (capture/trial/doubts.h)
  int evaluations = 0;
  std::function<void(double)> on_share = [](double) {};  // of many simulations: how many are there, 0 to 1
};

// The base's parameters, of study.parameters.
std::vector<model::Parameter> base_of(const Study& study);

bool has_markers(const std::vector<model::ObservedTrial>& trials);

// What a clock does to all that was seen alike.
bool is_of_clock(const model::Parameter& parameter);

// Effects that the base is found with: those that do not stand at neutral in study.base, and what is of a clock. A base
// that cannot move its clock bends the fabric's parameters in its place.
std::vector<size_t> found_with_base(const Study& study);

// Parameters of smooth forces, all neutral at zero, in shares of the fabric's weight: three directions times cosines of
// so many half waves along the width and the height. The further a wave is from the smoothest, the smaller its unit.
std::vector<model::Parameter> smooth_forces(const Protocol& protocol);

}  // namespace selvedge::diagnose
