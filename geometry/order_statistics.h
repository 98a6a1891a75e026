// Medians, and grey levels below which a share of pixels lies.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace selvedge::geometry {

// The middle value, the upper of two. values: at least one.
template <class T>
T median(std::vector<T> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// histogram: how many of `total` pixels have each grey level. The first level at or below which this share of them
// lies.
template <class Histogram>
int level_of_share(const Histogram& histogram, double share, double total) {
  double sum = 0;
  const auto levels = static_cast<int>(histogram.size());
  for (int level = 0; level < levels; ++level) {
    sum += static_cast<double>(histogram[static_cast<size_t>(level)]);
    if (sum >= share * total) return level;
  }
  return levels - 1;
}

}  // namespace selvedge::geometry
