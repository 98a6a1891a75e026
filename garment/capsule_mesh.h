// Capsules as triangles, to be drawn and written.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "cloth/contact/body.h"

namespace selvedge::garment {

struct DrawnMesh {
  Eigen::Matrix3Xd position;  // m
  std::vector<std::array<int, 3>> triangles;
};

DrawnMesh mesh_of(const std::vector<cloth::contact::Capsule>& capsules);

}  // namespace selvedge::garment
