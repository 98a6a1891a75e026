// Where projected stripes show the surface of the fabric, as points of the sheet that a hold can follow.
//
// A stripe edge is a point in space, but which point of the fabric it is no stripe tells. A simulation near the
// recording does: the camera's ray meets the simulated sheet there, and how much further along the ray the recorded one
// lies is known. Smoothed over the sheet that says where its surface was seen. Where a point lies along the surface
// stays open: a hold pulls across it.
#pragma once

#include <memory>

#include <Eigen/Core>

#include "cloth/guide.h"
#include "cloth/spline/view.h"
#include "observe/sensor_model.h"
#include "observe/stripe_residual.h"

namespace selvedge::model {

// At the first frame. control: what is simulated then, 3 × control points. Points that no stripe was near are NaN.
std::shared_ptr<const cloth::GuideTrack> seen_surface(const cloth::spline::SplineSheet& sheet,
                                                      const cloth::spline::View& view,
                                                      const observe::StripeTrack& stripes,
                                                      const Eigen::Matrix3Xd& control,
                                                      const observe::SensorModel& sensor);

}  // namespace selvedge::model
