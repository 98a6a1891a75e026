// Stripes that a projector shows, along its rows or columns.
//
// Horizontal: row r is bright where (r − first_bright_px) mod period_px < duty · period_px, r taken as a
// continuous coordinate, so edges lie at first_bright_px + k·period_px (dark to bright, r growing) and at
// first_bright_px + (k + duty)·period_px. Vertical: the same with columns. period_px 0: all bright.
// Duty 0: all dark.
#pragma once


#include <Eigen/Core>

namespace selvedge::render {

struct StripePattern {
  bool horizontal = true;
  double period_px = 16;       // projector pixels
  double duty = 0.5;           // 0 to 1
  double first_bright_px = 0;  // projector pixels
};

// 8-bit grey image, row major.
using Image = Eigen::Matrix<unsigned char, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace selvedge::render
