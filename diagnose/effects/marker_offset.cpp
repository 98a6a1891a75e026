#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// The held corners lie beside the tracked markers by a fixed step in space: what both share shifts everything, what
// they do not share changes their distance and direction.
namespace {

model::Parameter offset(const std::string& corner, char axis, Eigen::Matrix3Xd cloth::HeldPath::*path) {
  const int a = axis - 'x';
  return effect_parameter(corner + "_" + axis, "m", 0, -0.02, 0.02, 0.003, [a, path](model::Prediction& p, double v) {
    if (v != 0) (p.experiment.path.*path).row(a).array() += v;
  });
}

}  // namespace

Effect marker_offset() {
  Effect e{"marker_offset", Side::boundary, "the tracked markers are not at the held corners", {}};
  for (const char axis : {'x', 'y', 'z'}) {
    e.parameters.push_back(offset("left", axis, &cloth::HeldPath::left));
    e.parameters.push_back(offset("right", axis, &cloth::HeldPath::right));
  }
  return e;
}

}  // namespace selvedge::diagnose::effects
