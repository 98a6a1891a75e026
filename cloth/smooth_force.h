// A smooth force on the fabric that no law of the model gives: what a model may lack, wherever it comes from.
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace selvedge::cloth {

// Per flat area, fixed in the room: peak · cos(π along_u u / width) cos(π down_v v / height).
struct SmoothForce {
  Eigen::Vector3d peak_n_m2 = Eigen::Vector3d::Zero();
  int along_u = 0, down_v = 0;

  Eigen::Vector3d at(const Eigen::Vector2d& uv_m, double width_m, double height_m) const {
    return std::cos(M_PI * along_u * uv_m.x() / width_m) * std::cos(M_PI * down_v * uv_m.y() / height_m) * peak_n_m2;
  }
};

}  // namespace selvedge::cloth
