// The plane of the flat fabric.
#pragma once

#include <Eigen/Core>

namespace selvedge::geometry {

// Twice the signed area of the triangle 0, a, b.
inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace selvedge::geometry
