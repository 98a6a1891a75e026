#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// Nodes of a grid that are spaced evenly between the edges as they are seen, along straight lines, and not along the
// fabric: where it folds they are other points of it. The parameter is the share of the way there.
Effect grid_drift() {
  return {"grid_drift",
          Side::measurement,
          "the tracked nodes are no material points",
          {of_motion(effect_parameter("drift_share", "", 0, 0, 1.5, 0.3,
                                      [](model::Prediction& p, double v) { p.sensor.grid_drift = v; }))},
          AppliesTo::grids};
}

}  // namespace selvedge::diagnose::effects
