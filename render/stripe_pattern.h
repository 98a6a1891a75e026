// Stripes that a projector shows, along its rows or columns.
//
// Horizontal: row r (a whole number: mirrors are squares centred on whole coordinates) is bright where
// (r − first_bright_px) mod period_px < duty · period_px. Over the continuous coordinate x the border before the
// first bright row of a period lies half a pixel before that row, at ⌈first_bright_px + k·period_px⌉ − ½, and the
// border after its last bright row at ⌈first_bright_px + (k + duty)·period_px⌉ − ½. Vertical: the same with columns.
// The half-pixel is seen in recordings: without it surfaces triangulated from stripes miss the held corners by
// 0.7 mm at 1 m.
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace selvedge::render {

struct StripePattern {
  bool horizontal = true;
  double period_px = 16;       // projector pixels; above 0
  double duty = 0.5;           // 0 to 1
  double first_bright_px = 0;  // projector pixels
};

// Brightness of one mirror, 0 or 1.
inline double brightness(const StripePattern& pattern, int mirror) {
  const double from_first = mirror - pattern.first_bright_px;
  return from_first - pattern.period_px * std::floor(from_first / pattern.period_px) < pattern.duty * pattern.period_px;
}

// Position of a stripe's border, projector px: half_index 2k where bright period k begins, 2k + 1 where its
// bright part ends.
inline double border_px(const StripePattern& pattern, int half_index) {
  const int k = half_index >= 0 ? half_index / 2 : -((1 - half_index) / 2);
  const double share = half_index == 2 * k ? 0 : pattern.duty;
  return std::ceil(pattern.first_bright_px + (k + share) * pattern.period_px - 1e-9) - 0.5;
}

// 8-bit grey image, row major.
using Image = Eigen::Matrix<unsigned char, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace selvedge::render
