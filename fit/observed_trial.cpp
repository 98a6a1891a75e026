#include "fit/observed_trial.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "capture/trial/trial_summary.h"
#include "files/bad_input.h"
#include "fit/stripe_residual.h"

namespace selvedge::fit {

namespace {

cloth::Hold hold_of(trial::Held held) {
  switch (held) {
    case trial::Held::corners: return cloth::Hold::corners;
    case trial::Held::top_edge: return cloth::Hold::top_edge;
    case trial::Held::top_edge_clamped: return cloth::Hold::top_edge_clamped;
  }
  return cloth::Hold::corners;
}

// Spread of a corner about its median, m: still corners show the tracker's noise alone.
double travel(const Eigen::Matrix3Xd& corner) {
  double farthest = 0;
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (Eigen::Index i = 0; i < corner.cols(); ++i)
    if (corner.col(i).allFinite()) {
      low = low.cwiseMin(corner.col(i));
      high = high.cwiseMax(corner.col(i));
    }
  farthest = (high - low).norm();
  return farthest;
}

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

MarkerTrack track_markers(const trial::Trial& trial, const ObserveOptions& options, bool still) {
  const trial::Markers& m = *trial.markers;
  MarkerTrack track;
  track.noise_m = trial.mocap_noise_m.value_or(3e-4);
  std::map<int, Eigen::Index> row_of;
  for (size_t i = 0; i < m.marker.size(); ++i)
    if (row_of.emplace(m.marker[i], static_cast<Eigen::Index>(row_of.size())).second) track.uv.push_back(m.uv[i]);
  // Still fabric: every sample counts, as a mean at the first time.
  track.time_s =
      still ? std::vector<double>{std::max(options.from_s, m.time_s.front())} : thinned_times(m.time_s, options);
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

std::vector<double> sample_times(double start, double end, double rate_hz) {
  std::vector<double> times;
  for (int k = 0; start + (k - 2) / rate_hz < end; ++k) times.push_back(start + k / rate_hz);
  return times;
}

}  // namespace

ObservedTrial observe_trial(const trial::Trial& trial, const ObserveOptions& options) {
  for (const auto* corner : {&trial.corners.left, &trial.corners.right})
    if (corner->array().isNaN().all())
      refuse((trial.folder / "corners.csv").string(),
             "found no sample of one of the corners, expected both to be seen");
  ObservedTrial out;
  out.name = trial.name;
  out.kind = trial.experiment;
  out.width_m = trial.fabric.width_m;
  out.height_m = trial.fabric.height_m;
  const double noise = trial.mocap_noise_m.value_or(3e-4);
  out.still = trial.starts_at_rest &&
              std::max(travel(trial.corners.left), travel(trial.corners.right)) < std::max(0.004, 12 * noise);

  cloth::Experiment& e = out.experiment;
  e.material.density = trial.fabric.mass_kg / (trial.fabric.width_m * trial.fabric.height_m);
  e.gravity_m_s2 = trial.gravity_m_s2;
  const trial::Corners corners = trial.damaged.empty() ? trial.corners : trial::with_gaps_hidden(trial.corners);
  e.path = cloth::smooth_path(hold_of(trial.held), corners.time_s, corners.left, corners.right, out.still);
  e.path.clamp_direction = trial.clamp_direction.normalized();
  e.starts_at_rest = true;  // a trial that does not start at rest is led in from rest: its transient dies out
  e.start_s = trial.corners.time_s.front();

  double last = e.start_s;
  if (trial.markers) {
    out.markers = track_markers(trial, options, out.still);
    if (out.markers->time_s.empty())
      refuse((trial.folder / "markers.csv").string(), "found no sample between {} s and {} s", options.from_s,
             options.to_s);
    last = std::max(last, out.markers->time_s.back());
  }
  if (!trial.markers && trial.frames) {
    out.stripes = track_stripes(trial, options, out.still);
    last = std::max(last, last_time_s(*out.stripes));
  }
  if (!out.markers && !out.stripes)
    refuse(trial.folder.string(), "found neither markers.csv nor frames.csv, expected one of them");
  e.sample_s = out.still ? std::vector<double>{e.start_s} : sample_times(e.start_s, last, options.sample_rate_hz);
  return out;
}

}  // namespace selvedge::fit
