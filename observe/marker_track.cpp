#include "observe/marker_track.h"

#include <algorithm>
#include <limits>
#include <map>

#include "files/bad_input.h"

namespace selvedge::observe {

namespace {

// Distinct times of the markers that lie in the window, thinned to the rate.
std::vector<double> thinned_times(const std::vector<double>& all, const ObserveOptions& options) {
  std::vector<double> times;
  double next = -std::numeric_limits<double>::infinity();
  for (const double t : all) {
    if (t < options.from_s - 1e-9 || t > options.to_s + 1e-9 || t < next - 1e-6) continue;
    if (!times.empty() && t == times.back()) continue;
    times.push_back(t);
    next = std::max(next, t - 0.5 / options.rate_hz) + 1 / options.rate_hz;
    if (next < t) next = t + 1 / options.rate_hz;
  }
  return times;
}

}  // namespace

double stated_noise_m(const trial::Trial& trial) {
  constexpr double kUsual_m = 3e-4;
  return trial.mocap_noise_m.value_or(kUsual_m);
}

MarkerTrack track_markers(const trial::Trial& trial, const ObserveOptions& options, bool still) {
  const trial::Markers& m = *trial.markers;
  MarkerTrack track;
  track.noise_m = stated_noise_m(trial);
  std::map<int, Eigen::Index> row_of;
  for (size_t i = 0; i < m.marker.size(); ++i)
    if (row_of.emplace(m.marker[i], static_cast<Eigen::Index>(row_of.size())).second) track.uv.push_back(m.uv[i]);
  // Still fabric: every sample counts, as a mean at the first time.
  track.time_s =
      still ? std::vector<double>{std::max(options.from_s, m.time_s.front())} : thinned_times(m.time_s, options);
  if (track.time_s.empty())
    refuse((trial.folder / "markers.csv").string(), "found no sample between {} s and {} s", options.from_s,
           options.to_s);
  const auto times = static_cast<Eigen::Index>(track.time_s.size()), count = static_cast<Eigen::Index>(track.uv.size());
  track.position = Eigen::Matrix3Xd::Zero(3, times * count);
  Eigen::VectorXi seen = Eigen::VectorXi::Zero(times * count);
  for (size_t i = 0; i < m.marker.size(); ++i) {
    if (m.time_s[i] < options.from_s || m.time_s[i] > options.to_s) continue;
    const auto at = std::lower_bound(track.time_s.begin(), track.time_s.end(), m.time_s[i]);
    if (!still && (at == track.time_s.end() || *at != m.time_s[i])) continue;
    const Eigen::Index time = still ? 0 : at - track.time_s.begin();
    const Eigen::Index column = row_of[m.marker[i]] * times + time;
    track.position.col(column) += m.position.col(static_cast<Eigen::Index>(i));
    ++seen(column);
  }
  for (Eigen::Index c = 0; c < seen.size(); ++c) {
    if (seen(c) == 0) track.position.col(c).setConstant(std::numeric_limits<double>::quiet_NaN());
    else track.position.col(c) /= seen(c);
  }
  return track;
}

MarkerTrack beginning_of(const MarkerTrack& track, double until_s) {
  MarkerTrack out = track;
  const auto all = static_cast<Eigen::Index>(track.time_s.size()), markers = static_cast<Eigen::Index>(track.uv.size());
  out.time_s.erase(std::upper_bound(out.time_s.begin(), out.time_s.end(), until_s), out.time_s.end());
  const auto kept = static_cast<Eigen::Index>(out.time_s.size());
  out.position.resize(3, kept * markers);
  for (Eigen::Index k = 0; k < markers; ++k)
    out.position.middleCols(k * kept, kept) = track.position.middleCols(k * all, kept);
  return out;
}

}  // namespace selvedge::observe
