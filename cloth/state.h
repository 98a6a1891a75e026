// Where a fabric is and how fast it moves. Columns are vertices of its mesh.
#pragma once

#include <Eigen/Core>

namespace selvedge::cloth {

struct State {
  double time_s = 0;
  Eigen::Matrix3Xd position;  // 3×N, m
  Eigen::Matrix3Xd velocity;  // 3×N, m/s
};

}  // namespace selvedge::cloth
