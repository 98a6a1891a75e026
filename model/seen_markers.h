// What a tracker sees of a simulated sheet's markers, beside noise (observe::SensorModel), and where the sheet was as
// seen markers tell it.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "cloth/guide.h"
#include "cloth/spline/spline_sheet.h"
#include "model/observed_trial.h"
#include "model/parameter.h"
#include "observe/lost_frames.h"

namespace selvedge::model {

// m; columns as MarkerTrack::position of trial.markers. points: of its markers on the sheet.
Eigen::Matrix3Xd seen_markers(const cloth::spline::SplineSheet& sheet, const ObservedTrial& trial,
                              const std::vector<cloth::SurfacePoint>& points, const Prediction& prediction,
                              const cloth::Trajectory& trajectory);

// What a hold follows: the seen markers without what the sensor adds to them, single frames that jump held back
// (Huber 1981: a marker further than three deviations from where its neighbours in time have it counts as one at three;
// beside the motion of the held edge).
std::shared_ptr<const cloth::GuideTrack> guide_track(const cloth::spline::SplineSheet& sheet,
                                                     const ObservedTrial& trial,
                                                     const std::vector<cloth::SurfacePoint>& points,
                                                     const Prediction& prediction);

// When the fabric was as stamps show it, in the stamps' clock: a delay is part of the path (Simulation::predictions).
observe::StampDrift stamp_drift(const ObservedTrial& trial, const Prediction& prediction);
// As Guide::stamp_of.
std::function<double(double)> stamps_of(const ObservedTrial& trial, const Prediction& prediction);

// Control points between the samples of a trajectory (cubic in time).
Eigen::Matrix3Xd position_at(const cloth::Experiment& experiment, const cloth::Trajectory& trajectory, double t_s);

}  // namespace selvedge::model
