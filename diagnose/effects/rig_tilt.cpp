#include <Eigen/Geometry>

#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// Small turns of gravity about the two horizontal axes of the motion capture; each keeps its length.
namespace {

void turn_gravity(model::Prediction& p, const Eigen::Vector3d& axis, double angle_rad) {
  p.experiment.gravity_m_s2 = Eigen::AngleAxisd(angle_rad, axis) * p.experiment.gravity_m_s2;
}

}  // namespace

Effect rig_tilt() {
  return {"rig_tilt",
          Side::measurement,
          "gravity is not along the recorded direction",
          {effect_parameter("tilt_about_x", "rad", 0, -0.2, 0.2, 0.02,
                            [](model::Prediction& p, double v) { turn_gravity(p, Eigen::Vector3d::UnitX(), v); }),
           effect_parameter("tilt_about_y", "rad", 0, -0.2, 0.2, 0.02,
                            [](model::Prediction& p, double v) { turn_gravity(p, Eigen::Vector3d::UnitY(), v); })}};
}

}  // namespace selvedge::diagnose::effects
