#include "capture/trial/trial_summary.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "geometry/order_statistics.h"

namespace selvedge::trial {

Sampling sampling(const std::vector<double>& times_s) {
  Sampling result;
  if (times_s.empty()) return result;
  result.first_s = times_s.front();
  result.last_s = times_s.back();
  std::vector<double> steps;
  for (size_t i = 1; i < times_s.size(); ++i)
    if (times_s[i] > times_s[i - 1]) steps.push_back(times_s[i] - times_s[i - 1]);
  result.count = steps.size() + 1;
  if (steps.empty()) return result;
  const double median = geometry::median(steps);
  result.rate_hz = 1 / median;
  result.longest_gap_s = *std::max_element(steps.begin(), steps.end());
  result.gaps =
      static_cast<size_t>(std::count_if(steps.begin(), steps.end(), [&](double step) { return step > 1.5 * median; }));
  return result;
}

MarkerSummary summary(const Markers& markers) {
  MarkerSummary result;
  result.sampling = sampling(markers.time_s);
  result.markers = std::set<int>(markers.marker.begin(), markers.marker.end()).size();
  const double possible = static_cast<double>(result.markers * result.sampling.count);
  result.hidden_share = possible > 0 ? 1 - static_cast<double>(markers.marker.size()) / possible : 0;
  return result;
}

std::vector<Cloud> clouds(const Surface& surface) {
  std::vector<Cloud> out;
  for (size_t i = 0, end = 0; i < surface.time_s.size(); i = end) {
    while (end < surface.time_s.size() && surface.time_s[end] == surface.time_s[i]) ++end;
    out.push_back({surface.time_s[i],
                   surface.position.middleCols(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(end - i))});
  }
  return out;
}

size_t missing_numbers(const Frames& frames) {
  if (frames.number.empty()) return 0;
  return static_cast<size_t>(frames.number.back() - frames.number.front()) + 1 - frames.number.size();
}

Corners with_gaps_hidden(const Corners& corners) {
  const double rate_hz = sampling(corners.time_s).rate_hz;
  if (rate_hz == 0) return corners;
  Corners filled;
  std::vector<std::ptrdiff_t> source;  // -1: hidden
  for (size_t i = 0; i < corners.time_s.size(); ++i) {
    const double before_s = i == 0 ? corners.time_s[0] : corners.time_s[i - 1], step_s = corners.time_s[i] - before_s;
    const auto missing = step_s * rate_hz > 1.5 ? std::lround(step_s * rate_hz) - 1 : 0;
    for (long k = 1; k <= missing; ++k) {
      filled.time_s.push_back(before_s + step_s * static_cast<double>(k) / static_cast<double>(missing + 1));
      source.push_back(-1);
    }
    filled.time_s.push_back(corners.time_s[i]);
    source.push_back(static_cast<std::ptrdiff_t>(i));
  }
  const auto count = static_cast<Eigen::Index>(source.size());
  filled.left = filled.right = Eigen::Matrix3Xd::Constant(3, count, std::nan(""));
  for (Eigen::Index i = 0; i < count; ++i) {
    if (source[static_cast<size_t>(i)] < 0) continue;
    filled.left.col(i) = corners.left.col(source[static_cast<size_t>(i)]);
    filled.right.col(i) = corners.right.col(source[static_cast<size_t>(i)]);
  }
  return filled;
}

double hidden_share(const Eigen::Matrix3Xd& corner) {
  if (corner.cols() == 0) return 0;
  return static_cast<double>(corner.row(0).array().isNaN().count()) / static_cast<double>(corner.cols());
}

}  // namespace selvedge::trial
