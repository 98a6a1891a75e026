// Which further pose of the grid would make the calibration surest.
//
// Candidates: the grid as it was in its fullest pose, carried to 27 places of the fabric's volume and tilted
// six ways. One pose adds information:  C' = C − C Jᵀ (W⁻¹ + J C Jᵀ)⁻¹ J C  for each device that sees its
// markers. The candidate with the least sum of both deviations, each over what is good, wins. m, px.
// Source: J. Peng, P. Sturm, Calibration wizard, 2019, section 3.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/calibration.h"

namespace selvedge::calib {

struct NextPose {
  std::vector<Eigen::Vector3d> markers;  // where they would be
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  std::string tilt;  // in words, from how the grid was held in `like_pose`
  int like_pose = 0;
  double camera_sd_px = 0, projector_sd_px = 0;  // predicted with it
};

// Nothing where a device is not solved.
std::optional<NextPose> suggest_next_pose(const Calibration& calibration);

// A sentence on where to hold the grid, and what it would bring.
std::string to_text(const NextPose& next);

}  // namespace selvedge::calib
