#include "observe/marker_track.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include <Eigen/Dense>

#include "files/bad_input.h"
#include "geometry/order_statistics.h"

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

// What a parabola through a marker's samples about a time is there, the share of a sample's deviation that this one
// has, and the variance of the samples about it, an axis.
struct Smoothed {
  Eigen::Vector3d position;
  double noise_share = 1;
  std::optional<double> variance_m2;
};

// Median of a mean square of so many Gaussian numbers of variance 1 (Wilson and Hilferty 1931).
double median_square(double freedom) { return std::pow(1 - 2 / (9 * freedom), 3); }

std::optional<Smoothed> smoothed(const std::vector<double>& since_s, const std::vector<Eigen::Vector3d>& position) {
  const auto n = static_cast<Eigen::Index>(since_s.size());
  if (n < 4 || since_s.front() > 0 || since_s.back() < 0) return std::nullopt;
  const double unit = std::max(-since_s.front(), since_s.back());
  Eigen::MatrixX3d powers(n, 3);
  Eigen::MatrixX3d seen(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = since_s[static_cast<size_t>(i)] / unit;
    powers.row(i) << 1, t, t * t;
    seen.row(i) = position[static_cast<size_t>(i)].transpose();
  }
  const Eigen::Matrix3d inverse = (powers.transpose() * powers).inverse();
  const Eigen::Matrix3d parabola = inverse * (powers.transpose() * seen);
  Smoothed out{parabola.row(0).transpose(), std::sqrt(inverse(0, 0)), std::nullopt};
  if (n > 4) {
    const auto freedom = static_cast<double>(3 * (n - 3));
    out.variance_m2 = (seen - powers * parabola).squaredNorm() / freedom / median_square(freedom);
  }
  return out;
}

// From half_s before a stamp until half_s after it, on its own side of frames that are missing.
std::pair<double, double> span_about(double stamp_s, double half_s, const std::vector<LostFrames>& lost) {
  std::pair<double, double> out{stamp_s - half_s, stamp_s + half_s};
  for (const LostFrames& l : lost) {
    if (l.to_s <= stamp_s) out.first = std::max(out.first, l.to_s);
    else out.second = std::min(out.second, l.from_s);
  }
  return out;
}

// Each kept sample by its neighbours; the track's noise becomes the usual one of them. Where samples lie further from
// their parabolas than the noise that was stated has it, theirs counts.
void average(MarkerTrack& track, const trial::Markers& m, const std::map<int, Eigen::Index>& row_of,
             const ObserveOptions& options) {
  const auto times = static_cast<Eigen::Index>(track.time_s.size());
  std::vector<std::vector<std::pair<double, Eigen::Vector3d>>> seen(row_of.size());
  for (size_t i = 0; i < m.marker.size(); ++i) {
    const Eigen::Vector3d at = m.position.col(static_cast<Eigen::Index>(i));
    if (at.allFinite()) seen[static_cast<size_t>(row_of.at(m.marker[i]))].emplace_back(m.time_s[i], at);
  }
  std::vector<double> shares, variances;
  for (size_t k = 0; k < seen.size(); ++k) {
    std::stable_sort(seen[k].begin(), seen[k].end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (Eigen::Index j = 0; j < times; ++j) {
      const double t = track.time_s[static_cast<size_t>(j)];
      std::vector<double> since;
      std::vector<Eigen::Vector3d> position;
      const auto [first_s, last_s] = span_about(t, 0.5 / options.rate_hz + 1e-6, track.lost);
      for (auto s = std::lower_bound(seen[k].begin(), seen[k].end(), first_s,
                                     [](const auto&a, double at) { return a.first < at; });
           s != seen[k].end() && s->first <= last_s; ++s) {
        since.push_back(s->first - t);
        position.push_back(s->second);
      }
      Eigen::Matrix3Xd::ColXpr column = track.position.col(static_cast<Eigen::Index>(k) * times + j);
      if (!column.allFinite()) continue;
      const std::optional<Smoothed> by = smoothed(since, position);
      shares.push_back(by ? by->noise_share : 1);
      if (by && by->variance_m2) variances.push_back(*by->variance_m2);
      if (by) column = by->position;
    }
  }
  if (!variances.empty()) track.noise_m = std::max(track.noise_m, std::sqrt(geometry::median(std::move(variances))));
  if (!shares.empty()) track.noise_m *= geometry::median(std::move(shares));
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
  if (!still) track.lost = lost_frames(m, track.noise_m);
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
  if (options.thinning == Thinning::averaged) {
    if (still)
      track.noise_m /= std::sqrt(std::max(1.0, static_cast<double>(seen.sum()) / static_cast<double>(seen.size())));
    else average(track, m, row_of, options);
  }
  return track;
}

MarkerTrack piece_of(const MarkerTrack& track, double from_s, double to_s) {
  const auto first = std::lower_bound(track.time_s.begin(), track.time_s.end(), from_s) - track.time_s.begin(),
             end = std::upper_bound(track.time_s.begin(), track.time_s.end(), to_s) - track.time_s.begin();
  MarkerTrack out = track;
  out.time_s.assign(track.time_s.begin() + first, track.time_s.begin() + end);
  const auto all = static_cast<Eigen::Index>(track.time_s.size()), markers = static_cast<Eigen::Index>(track.uv.size());
  out.position.resize(3, (end - first) * markers);
  for (Eigen::Index k = 0; k < markers; ++k)
    out.position.middleCols(k * (end - first), end - first) = track.position.middleCols(k * all + first, end - first);
  return out;
}

}  // namespace selvedge::observe
