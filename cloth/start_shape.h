// A shape to start from, as a function of the flat sheet: of no mesh.
#pragma once

#include <functional>

#include <Eigen/Core>

#include "cloth/held_path.h"

namespace selvedge::cloth {

using ShapeOf = std::function<Eigen::Vector3d(const Eigen::Vector2d& uv)>;  // m

// A sheet hung where the rig holds it at start_s, bulging to a side (hung_shape in simulate.h).
ShapeOf hung(const HeldPath& path, double start_s, const Eigen::Vector3d& gravity_m_s2, double width_m, double side);

}  // namespace selvedge::cloth
