// A smooth force on the fabric that no law of the model gives: what a model may lack, wherever it comes from.
#pragma once

#include <Eigen/Core>

namespace selvedge::cloth {

// Per flat area, fixed in the room: peak · cos(π along_u u / width) cos(π down_v v / height).
struct SmoothForce {
  Eigen::Vector3d peak_n_m2 = Eigen::Vector3d::Zero();
  int along_u = 0, down_v = 0;
};

}  // namespace selvedge::cloth
