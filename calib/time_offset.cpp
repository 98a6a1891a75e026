#include "calib/time_offset.h"

#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <fmt/format.h>

#include "calib/spline_noise.h"
#include "geometry/cubic.h"

namespace selvedge::calib {

using geometry::CubicSpline;

namespace {

using Normal = Eigen::MatrixXd;  // pose shift (6), offset, a constant a marker where lines are compared
using Gradient = Eigen::VectorXd;
constexpr int kOffset = 6;

struct Problem {
  CameraParameters camera;
  std::map<int, CubicSpline> splines;
  std::map<int, int> constant_of;  // marker: place of its constant among the unknowns
  std::vector<TimedSighting> pixels;
  TimedLines lines;
  TimeOffsetOptions options;
  int size() const { return kOffset + 1 + static_cast<int>(constant_of.size()); }
};

struct Estimate {
  Gradient unknowns;
  explicit Estimate(const Problem& problem) : unknowns(Gradient::Zero(problem.size())) {}
  PoseShift shift() const { return unknowns.head<6>(); }
  double offset_s() const { return unknowns[kOffset]; }
};

// One sighting at an estimate, its residual whitened by nothing yet.
struct Compared {
  Eigen::VectorXd residual, speed;  // px, px/s
  Eigen::MatrixXd jacobian;         // by all unknowns
  Eigen::MatrixXd by_point;
  double noise_px = 0;
  double gap_s = 0, fraction = 0;  // of the track's samples about it
};

std::optional<std::pair<const CubicSpline*, double>> place_in_track(const Problem& problem, int marker, double time_s) {
  const auto found = problem.splines.find(marker);
  if (found == problem.splines.end() || found->second.gap_s(time_s) > problem.options.longest_gap_s)
    return std::nullopt;
  return std::pair(&found->second, time_s);
}

void set_motion(Compared& compared, const CubicSpline& spline, double time_s) {
  compared.speed = compared.by_point * spline.velocity(time_s);
  compared.jacobian.col(kOffset) = compared.speed;
  compared.gap_s = spline.gap_s(time_s);
  compared.fraction = spline.fraction(time_s);
}

std::optional<Compared> compare(const Problem& problem, const Estimate& at, const TimedSighting& s) {
  const auto place = place_in_track(problem, s.marker, s.time_s + at.offset_s());
  if (!place) return std::nullopt;
  const PoseShift shift = at.shift();
  const PixelDerivatives d = derivatives(problem.camera, place->first->position(place->second), &shift);
  Compared compared{
      d.pixel - s.pixel, {}, Eigen::MatrixXd::Zero(2, problem.size()), d.by_point, problem.options.pixel_noise_px};
  compared.jacobian.leftCols<6>() = d.by_shift;
  set_motion(compared, *place->first, place->second);
  return compared;
}

std::optional<Compared> compare(const Problem& problem, const Estimate& at, const TimedLine& s) {
  const auto place = place_in_track(problem, s.marker, s.time_s + at.offset_s());
  if (!place) return std::nullopt;
  const PoseShift shift = at.shift();
  const Eigen::Vector3d point = place->first->position(place->second);
  const PixelDerivatives seen = derivatives(problem.camera, point, &shift),
                         lit = derivatives(problem.lines.projector, point);
  const int axis = problem.lines.rows ? 1 : 0, constant = problem.constant_of.at(s.marker);
  const Eigen::RowVector2d slope = s.line.per_px.transpose();
  const double off_px = s.line.line_at(seen.pixel) - lit.pixel[axis] - at.unknowns[constant];
  Compared compared{Eigen::VectorXd::Constant(1, std::remainder(off_px, problem.lines.period_px)),
                    {},
                    Eigen::MatrixXd::Zero(1, problem.size()),
                    slope * seen.by_point - lit.by_point.row(axis),
                    problem.lines.noise_px};
  compared.jacobian.leftCols<6>() = slope * seen.by_shift;
  compared.jacobian(0, constant) = -1;
  set_motion(compared, *place->first, place->second);
  return compared;
}

// Calls visit(time, comparison) for all sightings that can be compared at an estimate.
template <class Visit>
void for_each_compared(const Problem& problem, const Estimate& at, const Visit& visit) {
  for (const TimedSighting& s : problem.pixels)
    if (const auto compared = compare(problem, at, s)) visit(s.time_s, *compared);
  for (const TimedLine& s : problem.lines.sightings)
    if (const auto compared = compare(problem, at, s)) visit(s.time_s, *compared);
}

struct Sums {
  Normal normal;
  Gradient gradient;
  double squares = 0;              // px²
  double weighted = 0;             // rᵀΣ⁻¹r
  double speed_squares = 0;        // px²/s²
  double noise_speed_squares = 0;  // of those, what the tracker's noise is worth
  int count = 0, values = 0;
  double degrees_of_freedom() const { return std::max(static_cast<double>(values - gradient.size()), 1.0); }
};

// by_frame: also the gradient of each frame's sightings.
Sums sum_up(const Problem& problem, const Estimate& at, double gate_sd,
            std::map<double, Gradient>* by_frame = nullptr) {
  const TimeOffsetOptions& options = problem.options;
  Sums sums{Normal::Zero(problem.size(), problem.size()), Gradient::Zero(problem.size())};
  for (int i = 0; i < 6; ++i) {
    const double sd = i < 3 ? options.turn_sd_rad : options.shift_sd_m;
    sums.normal(i, i) = 1 / (sd * sd);
    sums.gradient[i] = at.unknowns[i] / (sd * sd);
  }
  const double variance = options.tracker_noise_m * options.tracker_noise_m;
  for_each_compared(problem, at, [&](double time_s, const Compared& c) {
    const Eigen::MatrixXd from_point = c.by_point * c.by_point.transpose();
    const Eigen::MatrixXd covariance =
        c.noise_px * c.noise_px * Eigen::MatrixXd::Identity(from_point.rows(), from_point.cols()) +
        variance * from_point;
    const Eigen::MatrixXd weight = covariance.inverse();
    const double square = c.residual.dot(weight * c.residual);
    if (square > gate_sd * gate_sd) return;
    Gradient gradient = c.jacobian.transpose() * weight * c.residual;
    // What noise alone puts into the slope of the squares, as its variance changes between samples.
    gradient[kOffset] -= 0.5 * variance * variance_slope(c.fraction) / c.gap_s * (weight * from_point).trace();
    sums.normal += c.jacobian.transpose() * weight * c.jacobian;
    sums.gradient += gradient;
    if (by_frame) by_frame->try_emplace(time_s, Gradient::Zero(problem.size())).first->second += gradient;
    sums.squares += c.residual.squaredNorm();
    sums.weighted += square;
    sums.speed_squares += c.speed.squaredNorm();
    sums.noise_speed_squares += variance * from_point.trace() * velocity_variance(c.fraction) / (c.gap_s * c.gap_s);
    ++sums.count;
    sums.values += static_cast<int>(c.residual.size());
  });
  return sums;
}

// Robust cost of an offset with the pose held: residuals cut off at 30 px, so that wrong partners count little.
double scan_cost(const Problem& problem, double offset_s) {
  Estimate at(problem);
  at.unknowns[kOffset] = offset_s;
  double cost = 0;
  int count = 0;
  for_each_compared(problem, at, [&](double, const Compared& c) {
    cost += std::min(c.residual.squaredNorm(), 900.0);
    ++count;
  });
  return count > 20 ? cost / count : std::numeric_limits<double>::infinity();
}

// Gauss–Newton with the normal matrix scaled to unit diagonal; with_offset false holds the offset.
Estimate solve(const Problem& problem, Estimate at, double gate_sd, bool with_offset) {
  for (int round = 0; round < 25; ++round) {
    Sums sums = sum_up(problem, at, gate_sd);
    if (!with_offset) {
      sums.normal.row(kOffset).setZero();
      sums.normal.col(kOffset).setZero();
      sums.gradient[kOffset] = 0;
      sums.normal(kOffset, kOffset) = 1;
    }
    const Eigen::VectorXd scale = sums.normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * sums.normal * scale.asDiagonal();
    const Eigen::VectorXd step = -scale.cwiseProduct(scaled.ldlt().solve(scale.cwiseProduct(sums.gradient)));
    if (!step.allFinite()) return at;
    at.unknowns += step;
    if ((step.array() / scale.array()).abs().maxCoeff() < 1e-6 * std::sqrt(std::max(sums.count, 1))) break;
  }
  return at;
}

// Deviation of the offset from how the frames' gradients scatter, neighbours taken together.
double scatter_sd_s(const Problem& problem, const Estimate& at, double gate_sd) {
  std::map<double, Gradient> by_frame;
  const Normal inverse = sum_up(problem, at, gate_sd, &by_frame).normal.inverse();
  double variance = 0;
  for (auto a = by_frame.begin(); a != by_frame.end(); ++a) {
    const double score_a = inverse.row(kOffset).dot(a->second);
    for (auto b = a; b != by_frame.end() && b->first - a->first < problem.options.alike_s; ++b)
      variance += (a == b ? 1 : 2) * (1 - (b->first - a->first) / problem.options.alike_s) * score_a *
                  inverse.row(kOffset).dot(b->second);
  }
  return std::sqrt(std::max(variance, 0.0));
}

double rms(const Sums& sums) { return std::sqrt(sums.squares / std::max(sums.count, 1)); }

std::map<int, CubicSpline> splines_of(const std::vector<MarkerTrack>& tracks) {
  std::map<int, CubicSpline> splines;
  for (const MarkerTrack& track : tracks)
    if (track.time_s.size() >= 8) splines.emplace(track.marker, CubicSpline(track.time_s, track.position));
  return splines;
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

// Between samples the spline averages the tracker's noise. Where frames fall at one place in the interval h, that would
// draw the delay to the middle by up to 0.75 σ²/(h v²) with noise σ (px) and speed v (px/s). The gradient is freed of
// it as far as σ is known; a fifth of it is taken to remain.
double remaining_bias_s(const Problem& problem, const Estimate& at, double interval_s, double moving_squares) {
  double noise_squares = 0;
  for_each_compared(problem, at, [&](double, const Compared& c) {
    noise_squares += std::pow(problem.options.tracker_noise_m, 2) * c.by_point.squaredNorm() /
                     static_cast<double>(c.residual.size());
  });
  return 0.15 * noise_squares / (interval_s * moving_squares);
}

// Scan, then Gauss–Newton, the gate drawn in as the noise becomes known.
TimeOffset estimate(const Problem& problem, double interval_s) {
  const TimeOffsetOptions& options = problem.options;
  TimeOffset result;
  result.camera = problem.camera;
  const auto unknown = [&](const std::string& why) {
    result.why = why;
    return result;
  };
  Estimate best(problem);
  double least = std::numeric_limits<double>::infinity();
  for (double offset = -options.reach_s; offset <= options.reach_s + 1e-12; offset += options.step_s)
    if (const double cost = scan_cost(problem, offset); cost < least) {
      least = cost;
      best.unknowns[kOffset] = offset;
    }
  if (!std::isfinite(least)) return unknown("fewer than 20 sightings of tracked markers in common time");

  double gate_sd = 1e6;
  const Estimate without = solve(problem, Estimate(problem), gate_sd, false);
  result.rms_without_px = rms(sum_up(problem, without, gate_sd));
  best = solve(problem, best, gate_sd, true);
  for (int round = 0; round < 8; ++round) {
    // The noise may be larger than stated: the gate is as wide as it is.
    const Sums all = sum_up(problem, best, gate_sd);
    const double drawn_in = options.gate_sd * std::sqrt(std::max(all.weighted / all.degrees_of_freedom(), 1.0));
    if (drawn_in > 0.97 * gate_sd) break;
    gate_sd = drawn_in;
    best = solve(problem, best, gate_sd, true);
  }
  const Sums sums = sum_up(problem, best, gate_sd);
  // Speeds that are the tracker's noise tell nothing of the delay; its deviation is known to a tenth.
  const double moving_squares =
      std::max(sums.speed_squares - 1.2 * sums.noise_speed_squares, 1e-3 * sums.speed_squares) + 1e-12;
  result.offset_s = best.offset_s();
  result.rms_px = rms(sums);
  result.sightings = sums.count;
  result.speed_px_s = std::sqrt(moving_squares / std::max(sums.count, 1));
  result.camera = shifted(problem.camera, best.shift());
  result.expected_bias_s = remaining_bias_s(problem, best, interval_s, moving_squares);
  const double residual_sd_s =
      std::sqrt(Normal(sums.normal.inverse())(kOffset, kOffset) * sums.weighted / sums.degrees_of_freedom());
  const double random_s =
      std::max(residual_sd_s, scatter_sd_s(problem, best, gate_sd)) * sums.speed_squares / moving_squares;
  result.sd_s = std::hypot(random_s, result.expected_bias_s, options.common_px / result.speed_px_s);
  if (std::abs(result.offset_s) > options.reach_s)
    return unknown(fmt::format("the delay found, {:.1f} ms, lies beyond the {:.0f} ms looked at", 1e3 * result.offset_s,
                               1e3 * options.reach_s));
  if (!(result.sd_s < options.most_sd_s))
    return unknown(fmt::format(
        "the markers move too little: {:.1f} px/s leave it uncertain by {:.1f} ms; move them by 100 mm or more, "
        "once a second",
        result.speed_px_s, 1e3 * result.sd_s));
  result.known = true;
  return result;
}

}  // namespace

TimeOffset estimate_time_offset(const CameraParameters& camera, const std::vector<MarkerTrack>& tracks,
                                const std::vector<TimedSighting>& sightings, const TimeOffsetOptions& options) {
  return estimate({camera, splines_of(tracks), {}, sightings, {}, options}, sample_interval_s(tracks));
}

TimeOffset estimate_time_offset(const CameraParameters& camera, const std::vector<MarkerTrack>& tracks,
                                const TimedLines& lines, const TimeOffsetOptions& options) {
  Problem problem{camera, splines_of(tracks), {}, {}, lines, options};
  for (const TimedLine& s : lines.sightings) problem.constant_of.try_emplace(s.marker, problem.size());
  return estimate(problem, sample_interval_s(tracks));
}

}  // namespace selvedge::calib
