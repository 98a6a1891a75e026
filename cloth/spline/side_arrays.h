// One direction of a sheet as the kernels read it.
#pragma once

#include <vector>

#include "cloth/spline/kernel/tables.h"
#include "cloth/spline/spline_sheet.h"

namespace selvedge::cloth::spline {

// T: float or double.
template <class T>
struct SideArrays {
  std::vector<int> first, greville_first;
  std::vector<T> value, slope, second, weight, mass, slope_product, bend, inverse, greville_value, greville_slope, area;

  explicit SideArrays(const Side& side);
  kernel::SideTables<T> tables() const;
};
extern template struct SideArrays<float>;
extern template struct SideArrays<double>;

}  // namespace selvedge::cloth::spline
