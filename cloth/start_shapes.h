// Shapes to start from, as functions of the flat sheet: of no mesh.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "cloth/held_path.h"

namespace selvedge::cloth {

using ShapeOf = std::function<Eigen::Vector3d(const Eigen::Vector2d& uv)>;  // m

// A sheet hung where the rig holds it at start_s, bulging to a side (hung_shape in simulate.h).
ShapeOf hung(const HeldPath& path, double start_s, const Eigen::Vector3d& gravity_m_s2, double width_m, double side);

// A thin plate (−r² ln r … plus an affine part) through shifts at points of the fabric, one a column, m. At least three
// points that lie on no line; a trace of smoothing takes a sensor's noise. scale_m: size of the fabric.
ShapeOf thin_plate(const std::vector<Eigen::Vector2d>& uv, const Eigen::Matrix3Xd& shift, double scale_m);

}  // namespace selvedge::cloth
