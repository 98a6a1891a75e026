// An 8-bit grey image, row major; (row, column) of the top-left pixel is (0, 0).
#pragma once

#include <Eigen/Core>

namespace selvedge::calib {

using GreyImage = Eigen::Matrix<unsigned char, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace selvedge::calib
