#include "capture/trial/trial_summary.h"

#include <algorithm>
#include <set>

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
  std::vector<double> sorted = steps;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const double median = sorted[sorted.size() / 2];
  result.rate_hz = 1 / median;
  result.longest_gap_s = *std::max_element(steps.begin(), steps.end());
  result.gaps = static_cast<size_t>(
      std::count_if(steps.begin(), steps.end(), [&](double step) { return step > 1.5 * median; }));
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

size_t missing_numbers(const Frames& frames) {
  if (frames.number.empty()) return 0;
  return static_cast<size_t>(frames.number.back() - frames.number.front()) + 1 - frames.number.size();
}

double hidden_share(const Eigen::Matrix3Xd& corner) {
  if (corner.cols() == 0) return 0;
  return static_cast<double>(corner.row(0).array().isNaN().count()) / static_cast<double>(corner.cols());
}

}  // namespace selvedge::trial
