#include "calib/time_offset.h"

#include <cmath>
#include <limits>
#include <map>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <fmt/format.h>

#include "calib/cubic_spline.h"

namespace selvedge::calib {

namespace {

using Normal = Eigen::Matrix<double, 7, 7>;     // pose shift (6), offset
using Gradient = Eigen::Matrix<double, 7, 1>;

struct Problem {
  const CameraParameters* camera;
  std::map<int, CubicSpline> splines;
  const std::vector<TimedSighting>* sightings;
  const TimeOffsetOptions* options;
};

struct Estimate {
  PoseShift shift = PoseShift::Zero();
  double offset_s = 0;
};

// Sums over the sightings that can be interpolated at an offset.
struct Sums {
  Normal normal = Normal::Zero();
  Gradient gradient = Gradient::Zero();
  double squares = 0;        // px²
  double weighted = 0;       // rᵀΣ⁻¹r
  double speed_squares = 0;  // px²/s²
  int count = 0;
};

Sums sum_up(const Problem& problem, const Estimate& at, double gate_sd) {
  Sums sums;
  const TimeOffsetOptions& options = *problem.options;
  for (const TimedSighting& s : *problem.sightings) {
    const auto found = problem.splines.find(s.marker);
    if (found == problem.splines.end()) continue;
    const double time = s.time_s + at.offset_s;
    if (found->second.gap_s(time) > options.longest_gap_s) continue;
    const Eigen::Vector3d point = found->second.position(time);
    const PixelDerivatives d = derivatives(*problem.camera, point, &at.shift);
    const Eigen::Vector2d residual = d.pixel - s.pixel;
    const Eigen::Matrix2d weight =
        (options.pixel_noise_px * options.pixel_noise_px * Eigen::Matrix2d::Identity() +
         options.tracker_noise_m * options.tracker_noise_m * d.by_point * d.by_point.transpose()).inverse();
    const double square = residual.dot(weight * residual);
    if (square > gate_sd * gate_sd) continue;
    const Eigen::Vector2d speed = d.by_point * found->second.velocity(time);
    Eigen::Matrix<double, 2, 7> jacobian;
    jacobian << d.by_shift, speed;
    sums.normal += jacobian.transpose() * weight * jacobian;
    sums.gradient += jacobian.transpose() * weight * residual;
    // What noise alone puts into the slope of the squares, as its variance changes between samples.
    const double variance_rate = options.tracker_noise_m * options.tracker_noise_m *
                                 variance_slope(found->second.fraction(time)) / found->second.gap_s(time);
    sums.gradient[6] -= 0.5 * variance_rate * (weight * d.by_point * d.by_point.transpose()).trace();
    sums.squares += residual.squaredNorm();
    sums.weighted += square;
    sums.speed_squares += speed.squaredNorm();
    ++sums.count;
  }
  return sums;
}

// Robust cost of an offset with the pose held: residuals cut off at 30 px, so that wrong partners count little.
double scan_cost(const Problem& problem, double offset_s) {
  double cost = 0;
  int count = 0;
  for (const TimedSighting& s : *problem.sightings) {
    const auto found = problem.splines.find(s.marker);
    if (found == problem.splines.end()) continue;
    const double time = s.time_s + offset_s;
    if (found->second.gap_s(time) > problem.options->longest_gap_s) continue;
    cost += std::min((pixel_of(*problem.camera, found->second.position(time)) - s.pixel).squaredNorm(), 900.0);
    ++count;
  }
  return count > 20 ? cost / count : std::numeric_limits<double>::infinity();
}

// Gauss–Newton with the normal matrix scaled to unit diagonal; with_offset false holds the offset.
Estimate solve(const Problem& problem, Estimate at, double gate_sd, bool with_offset) {
  for (int round = 0; round < 25; ++round) {
    const Sums sums = sum_up(problem, at, gate_sd);
    const int size = with_offset ? 7 : 6;
    const Eigen::MatrixXd normal = sums.normal.topLeftCorner(size, size);
    const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * normal * scale.asDiagonal();
    const Eigen::VectorXd right = scale.cwiseProduct(sums.gradient.head(size));
    const Eigen::VectorXd step = -scale.cwiseProduct(scaled.ldlt().solve(right));
    if (!step.allFinite()) return at;
    at.shift += step.head<6>();
    if (with_offset) at.offset_s += step[6];
    if ((step.array() / scale.array()).abs().maxCoeff() < 1e-6 * std::sqrt(std::max(sums.count, 1))) break;
  }
  return at;
}

double rms(const Sums& sums) { return std::sqrt(sums.squares / std::max(sums.count, 1)); }

Problem set_up(const CameraParameters& camera, const std::vector<MarkerTrack>& tracks,
               const std::vector<TimedSighting>& sightings, const TimeOffsetOptions& options) {
  Problem problem{&camera, {}, &sightings, &options};
  for (const MarkerTrack& track : tracks)
    if (track.time_s.size() >= 8) problem.splines.emplace(track.marker, CubicSpline(track.time_s, track.position));
  return problem;
}

// Median interval between the tracker's samples: how often its noise is drawn anew.
double sample_interval_s(const std::vector<MarkerTrack>& tracks) {
  double sum = 0;
  int count = 0;
  for (const MarkerTrack& track : tracks)
    if (track.time_s.size() >= 2) {
      sum += (track.time_s.back() - track.time_s.front()) / static_cast<double>(track.time_s.size() - 1);
      ++count;
    }
  return count > 0 ? sum / count : 0;
}

}  // namespace

TimeOffset estimate_time_offset(const CameraParameters& camera, const std::vector<MarkerTrack>& tracks,
                                const std::vector<TimedSighting>& sightings, const TimeOffsetOptions& options) {
  TimeOffset result;
  result.camera = camera;
  const Problem problem = set_up(camera, tracks, sightings, options);
  const auto unknown = [&](const std::string& why) {
    result.why = why;
    return result;
  };
  Estimate best;
  double least = std::numeric_limits<double>::infinity();
  for (double offset = -options.reach_s; offset <= options.reach_s + 1e-12; offset += options.step_s)
    if (const double cost = scan_cost(problem, offset); cost < least) {
      least = cost;
      best.offset_s = offset;
    }
  if (!std::isfinite(least)) return unknown("fewer than 20 sightings of tracked markers in common time");

  const double wide = 1e6;
  const Estimate without = solve(problem, {}, wide, false);
  result.rms_without_px = rms(sum_up(problem, without, wide));
  best = solve(problem, best, wide, true);
  // The noise may be larger than stated: the gate widens with it.
  const Sums all = sum_up(problem, best, wide);
  const double excess = std::sqrt(std::max(all.weighted / std::max(2.0 * all.count - 7, 1.0), 1.0));
  best = solve(problem, best, options.gate_sd * excess, true);
  const Sums sums = sum_up(problem, best, options.gate_sd * excess);
  const double variance_factor = std::max(sums.weighted / std::max(2.0 * sums.count - 7, 1.0), 1.0);
  result.offset_s = best.offset_s;
  result.sd_s = std::sqrt(Normal(sums.normal.inverse())(6, 6) * variance_factor);
  result.rms_px = rms(sums);
  result.sightings = sums.count;
  result.speed_px_s = std::sqrt(sums.speed_squares / std::max(sums.count, 1));
  result.camera = shifted(camera, best.shift);

  // Between samples the spline averages the tracker's noise. Where frames fall at one place in the interval h,
  // that would draw the delay to the middle by up to 0.75 σ²/(h v²) with noise σ (px) and speed v (px/s). The
  // gradient is freed of it as far as σ is known; a fifth of it is taken to remain.
  const double interval = sample_interval_s(tracks);
  const double px_per_m = camera[0] / std::max(depth_of(result.camera, tracks.front().position.front()), 0.1);
  const double noise_px = options.tracker_noise_m * px_per_m;
  result.expected_bias_s =
      std::min(0.15 * noise_px * noise_px / (interval * std::max(std::pow(result.speed_px_s, 2), 1e-9)), interval / 2);
  if (std::abs(best.offset_s) > options.reach_s)
    return unknown(fmt::format("the delay found, {:.1f} ms, lies beyond the {:.0f} ms looked at", 1e3 * best.offset_s, 1e3 * options.reach_s));
  if (!(result.sd_s < options.most_sd_s))
    return unknown(fmt::format("the markers move too little: {:.1f} px/s leave the delay uncertain by {:.1f} ms", result.speed_px_s, 1e3 * result.sd_s));
  if (result.expected_bias_s > std::max(options.most_bias_share * result.sd_s, options.harmless_bias_s))
    return unknown(fmt::format("the markers move too little: at {:.0f} px/s the tracker's noise may shift the delay by {:.2f} ms, "
                               "more than its deviation of {:.2f} ms; move them by 100 mm or more, once a second", result.speed_px_s,
                               1e3 * result.expected_bias_s, 1e3 * result.sd_s));
  result.known = true;
  return result;
}

}  // namespace selvedge::calib
