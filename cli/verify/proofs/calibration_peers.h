// The same labelled sightings solved by OpenCV's calibrateCamera and by mrcal, for the table beside ours.
//
// Both get every pose as points in the tracker's frame, fixed and without error, which is what they can take,
// the k1 k2 p1 p2 model, and our linear start. m, px.
// Source: OpenCV 4.6 calib3d; mrcal 2.2, mrcal_optimize() with fixed points.
#pragma once

#include <vector>

#include "calib/refine.h"

namespace selvedge::cli {

geometry::Projection solve_with_opencv(const std::vector<calib::Sighting>& sightings, const calib::ImageSize& size,
                                       const calib::CameraParameters& start);

geometry::Projection solve_with_mrcal(const std::vector<calib::Sighting>& sightings, const calib::ImageSize& size,
                                      const calib::CameraParameters& start);

}  // namespace selvedge::cli
