// What the figures of a calibration mean: a verdict, and sentences that say what is wrong and what to do.
//
// refused: the data do not determine a matrix, or it is off by more than Options::refused_sd_px where the
// fabric moves. doubtful: usable, but something happened that a lab should know or mend. good: the rest.
// Source: docs/calibration.md.
#pragma once

#include <string>

#include "calib/calibration.h"

namespace selvedge::calib {

// Fills verdict and advice from everything else.
void judge(Calibration& calibration);

// How far a knock turned and carried the device.
struct Displacement {
  double angle_deg = 0;
  double distance_mm = 0;
};
Displacement device_displacement(const CameraParameters& camera, const PoseShift& shift);

// Mean over the points of how far their pixels lie from where they lay before the shift, px.
double shift_at_fabric_px(const CameraParameters& camera, const PoseShift& shift,
                          const std::vector<Eigen::Vector3d>& volume);

// The last pose before another; that pose itself where it is the first.
int pose_before(const DeviceSolution& solution, int pose);

// How far a board must have moved to be seen under the shift, at the mean of its points.
Displacement board_displacement(const CameraParameters& camera, const PoseShift& shift,
                                const Eigen::Vector3d& board_mean);

}  // namespace selvedge::calib
