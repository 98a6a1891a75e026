// Lines of points in a plane, 2×N.
#pragma once

#include <Eigen/Core>

namespace selvedge::geometry {

// From the first point to the last.
inline double polyline_length(const Eigen::Matrix2Xd& line) {
  const Eigen::Index steps = line.cols() - 1;
  return steps < 1 ? 0 : (line.rightCols(steps) - line.leftCols(steps)).colwise().norm().sum();
}

// Inside a closed line, whose last point is joined to the first: positive where it runs anticlockwise.
inline double polygon_area(const Eigen::Matrix2Xd& line) {
  double twice = 0;
  for (Eigen::Index i = 0, n = line.cols(); i < n; ++i)
    twice += line(0, i) * line(1, (i + 1) % n) - line(0, (i + 1) % n) * line(1, i);
  return twice / 2;
}

}  // namespace selvedge::geometry
