// Which frames of pictures or clouds are compared, and how many of what each shows.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "observe/marker_track.h"

namespace selvedge::observe {

// Places of the times in the window, thinned to options.rate_hz; of still fabric the first three.
inline std::vector<size_t> kept_frames(const std::vector<double>& time_s, const ObserveOptions& options, bool still) {
  constexpr size_t kStillFrames = 3;
  std::vector<size_t> kept;
  double next = -1e300;
  for (size_t i = 0; i < time_s.size(); ++i) {
    const double t = time_s[i];
    if (t < options.from_s - 1e-9 || t > options.to_s + 1e-9 || t < next - 1e-6) continue;
    next = t + 1 / options.rate_hz - 1e-3;
    kept.push_back(i);
    if (still && kept.size() >= kStillFrames) break;
  }
  return kept;
}

// Every n-th of a list, so that at most so many are left.
template <class T>
std::vector<T> every_nth(const std::vector<T>& all, size_t at_most) {
  const size_t n = std::max<size_t>(1, (all.size() + at_most - 1) / at_most);
  std::vector<T> few;
  for (size_t i = n / 2; i < all.size(); i += n) few.push_back(all[i]);
  return few;
}

}  // namespace selvedge::observe
