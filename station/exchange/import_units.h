// [units] of a mapping: what turns lengths, times and axes of others into m, s, right-handed, z up.
#pragma once

#include <Eigen/Core>

#include "files/toml_file.h"

namespace selvedge::station {

struct Units {
  double length_m = 1, time_s = 1;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // ours from theirs
  Eigen::Vector3d point(double x, double y, double z) const { return length_m * (axes * Eigen::Vector3d(x, y, z)); }
};

// Throws BadInput naming the key.
Units read_units(files::Section keys);

}  // namespace selvedge::station
