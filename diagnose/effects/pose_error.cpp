#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// The camera's pose in the tracker's frame, as a small turn about that frame's axes and a shift: fixed in the room.
namespace {

model::Parameter turn(const std::string& name, int axis) {
  return of_motion(effect_parameter(name, "rad", 0, -0.2, 0.2, 0.01,
                                    [axis](model::Prediction& p, double v) { p.sensor.turn_rad(axis) = v; }));
}

model::Parameter shift(const std::string& name, int axis) {
  return of_motion(effect_parameter(name, "m", 0, -0.1, 0.1, 0.003,
                                    [axis](model::Prediction& p, double v) { p.sensor.shift_m(axis) = v; }));
}

}  // namespace

Effect pose_error() {
  return {"pose_error",
          Side::measurement,
          "camera and tracker do not share one frame",
          {turn("camera_turn_x", 0), turn("camera_turn_y", 1), turn("camera_turn_z", 2), shift("camera_x", 0),
           shift("camera_y", 1), shift("camera_z", 2)},
          AppliesTo::places};
}

}  // namespace selvedge::diagnose::effects
