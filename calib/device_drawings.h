// Pictures of one device's calibration as SVG text, in the device's image. px.
#pragma once

#include <string>
#include <vector>

#include "calib/calibration.h"

namespace selvedge::calib {

// A round factor that makes the usual residual some ten pixels long in the picture.
double residual_magnification(const DeviceSolution& solution);

// Trusted sightings as dots with their residual vectors magnified; rejected ones as crosses.
std::string draw_residuals(const DeviceSolution& solution, double magnification);

// Predicted deviation per axis over the image of the plane through the middle of the volume that faces the device,
// with the figure written in every cell.
std::string draw_deviation(const DeviceSolution& solution, const Eigen::Vector3d& low, const Eigen::Vector3d& high);

// Trusted sightings with each pose's outline and number, over the outline of the fabric's volume; the next pose's
// markers as rings within a dashed outline.
std::string draw_coverage(const DeviceSolution& solution, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                          const std::vector<Eigen::Vector3d>& next_markers);

}  // namespace selvedge::calib
