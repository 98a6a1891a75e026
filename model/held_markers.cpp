#include "model/held_markers.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>

#include "geometry/order_statistics.h"

namespace selvedge::model {

using Eigen::Index;
using Eigen::Vector3d;

namespace {

constexpr double kOnEdge = 1e-3;  // of the width: so near a held point a marker is held

struct Seen {
  double along = 0;
  Vector3d departure = Vector3d::Zero();
};

// Least squares; of one marker, or of some at one place, no slope.
Jump line_through(const std::vector<Seen>& seen) {
  Jump out;
  if (seen.empty()) return out;
  double mean_s = 0;
  Vector3d mean = Vector3d::Zero();
  for (const Seen& m : seen) {
    mean_s += m.along;
    mean += m.departure;
  }
  mean_s /= static_cast<double>(seen.size());
  mean /= static_cast<double>(seen.size());
  double square = 0;
  for (const Seen& m : seen) {
    square += (m.along - mean_s) * (m.along - mean_s);
    out.along += (m.along - mean_s) * (m.departure - mean);
  }
  if (square > kOnEdge * kOnEdge) out.along /= square;
  else out.along.setZero();
  out.left = mean - mean_s * out.along;
  return out;
}

Vector3d seen_at(const observe::MarkerTrack& track, size_t marker, size_t time) {
  return track.position.col(static_cast<Index>(marker * track.time_s.size() + time));
}

std::vector<Seen> departures(const ObservedTrial& trial, const cloth::HeldPath& path,
                             const std::vector<HeldMarker>& held, size_t time, double delay_s = 0) {
  const Eigen::Matrix<double, 3, 2> ends = path.at(trial.markers->time_s[time] - delay_s);
  std::vector<Seen> out;
  for (const HeldMarker& h : held) {
    const Vector3d at = seen_at(*trial.markers, h.marker, time);
    if (at.allFinite()) out.push_back({h.along, at - ends * Eigen::Vector2d(1 - h.along, h.along)});
  }
  return out;
}

Jump mean_of(const std::vector<Jump>& jumps) {
  Jump mean;
  for (const Jump& j : jumps) {
    mean.left += j.left / static_cast<double>(jumps.size());
    mean.along += j.along / static_cast<double>(jumps.size());
  }
  return mean;
}

}  // namespace

std::vector<HeldMarker> held_markers(const ObservedTrial& trial) {
  std::vector<HeldMarker> out;
  if (!trial.markers) return out;
  const bool whole_edge = trial.experiment.path.hold == cloth::Hold::top_edge ||
                          trial.experiment.path.hold == cloth::Hold::top_edge_clamped;
  const double near_m = kOnEdge * trial.width_m;
  for (size_t k = 0; k < trial.markers->uv.size(); ++k) {
    const Eigen::Vector2d& uv = trial.markers->uv[k];
    const bool at_corner = uv.x() < near_m || uv.x() > trial.width_m - near_m;
    if (uv.y() < near_m && (whole_edge || at_corner)) out.push_back({k, uv.x() / trial.width_m});
  }
  return out;
}

bool is_outline_grid(const ObservedTrial& trial) {
  if (!trial.markers || trial.markers->uv.empty()) return false;
  Eigen::Vector2d low = trial.markers->uv.front(), high = low;
  for (const Eigen::Vector2d& uv : trial.markers->uv) {
    low = low.cwiseMin(uv);
    high = high.cwiseMax(uv);
  }
  const Eigen::Vector2d size(trial.width_m, trial.height_m), near_m = kOnEdge * size;
  return (low.array() < near_m.array()).all() && (high.array() > (size - near_m).array()).all();
}

Jumps::Jumps(const ObservedTrial& trial, const cloth::HeldPath& path) : held_(held_markers(trial)) {
  if (held_.empty()) return;
  const size_t times = trial.markers->time_s.size();
  others_.resize(held_.size());
  double square = 0, freedom = 0, whole = 0, count = 0;
  for (size_t j = 0; j < times; ++j) {
    const std::vector<Seen> all = departures(trial, path, held_, j);
    of_all_.push_back(line_through(all));
    for (const Seen& m : all) whole += m.departure.squaredNorm();
    count += static_cast<double>(all.size());
    if (all.size() > 2) {
      for (const Seen& m : all) square += (m.departure - of_all_.back().at(m.along)).squaredNorm();
      freedom += 3 * static_cast<double>(all.size() - 2);
    }
    for (size_t h = 0; h < held_.size(); ++h) {
      std::vector<Seen> others;
      std::copy_if(all.begin(), all.end(), std::back_inserter(others),
                   [&](const Seen& m) { return m.along != held_[h].along; });
      others_[h].push_back(line_through(others));
    }
  }
  const Jump mean = mean_of(of_all_);
  const auto less_mean = [&](std::vector<Jump>& jumps) {
    for (Jump& j : jumps) {
      j.left -= mean.left;
      j.along -= mean.along;
    }
  };
  less_mean(of_all_);
  for (std::vector<Jump>& jumps : others_) less_mean(jumps);
  distance_m_ = count > 0 ? std::sqrt(whole / count) : 0;
  noise_m_ = freedom > 0 ? std::sqrt(square / freedom) : 0;
}

Vector3d Jumps::of(size_t time, size_t k, double along) const {
  for (size_t h = 0; h < held_.size(); ++h)
    if (held_[h].marker == k) return others_[h][time].at(along);
  return at(time, along);
}

double Jumps::middle_m() const {
  double square = 0;
  for (const Jump& j : of_all_) square += j.at(0.5).squaredNorm();
  return of_all_.empty() ? 0 : std::sqrt(square / 3 / static_cast<double>(of_all_.size()));
}

double Jumps::ends_m() const {
  double square = 0;
  for (const Jump& j : of_all_) square += 0.25 * j.along.squaredNorm();
  return of_all_.empty() ? 0 : std::sqrt(square / 3 / static_cast<double>(of_all_.size()));
}

namespace {

// How far a trial's held markers lie from the path at a delay, without what lasts: the mean distance over times, m.
// Distances, not their squares: some frames are far off at any delay.
double misfit_m(const ObservedTrial& trial, const std::vector<HeldMarker>& held, double delay_s) {
  std::vector<Vector3d> middle;
  for (size_t j = 0; j < trial.markers->time_s.size(); ++j) {
    const std::vector<Seen> seen = departures(trial, trial.experiment.path, held, j, delay_s);
    if (!seen.empty()) middle.push_back(line_through(seen).at(0.5));
  }
  Vector3d lasting;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Vector3d& m : middle) values.push_back(m(axis));
    lasting(axis) = values.empty() ? 0 : geometry::median(std::move(values));
  }
  double sum = 0;
  for (const Vector3d& m : middle) sum += (m - lasting).norm();
  return middle.empty() ? 0 : sum / static_cast<double>(middle.size());
}

// The least of a function by steps, and between them by a parabola.
double least_of(const std::function<double(double)>& misfit, double most_s) {
  constexpr double kStep_s = 0.005;
  const auto steps = static_cast<int>(std::lround(most_s / kStep_s));
  std::vector<double> values;
  for (int k = -steps; k <= steps; ++k) values.push_back(misfit(k * kStep_s));
  const auto best = static_cast<size_t>(std::min_element(values.begin(), values.end()) - values.begin());
  double at = (static_cast<double>(best) - steps) * kStep_s;
  if (best > 0 && best + 1 < values.size()) {
    const double bend = values[best - 1] - 2 * values[best] + values[best + 1];
    if (bend > 0) at += 0.5 * kStep_s * (values[best - 1] - values[best + 1]) / bend;
  }
  return at;
}

}  // namespace

std::optional<HeldDelay> held_delay(const std::vector<ObservedTrial>& trials, double most_s) {
  struct Moving {
    const ObservedTrial* trial;
    std::vector<HeldMarker> held;
  };
  std::vector<Moving> moving;
  for (const ObservedTrial& trial : trials)
    if (!trial.still)
      if (std::vector<HeldMarker> held = held_markers(trial); !held.empty())
        moving.push_back({&trial, std::move(held)});
  if (moving.empty()) return {};
  HeldDelay out;
  out.delay_s = least_of(
      [&](double delay) {
    double sum = 0;
    for (const Moving& m : moving) sum += misfit_m(*m.trial, m.held, delay);
    return sum;
      },
      most_s);
  double square = 0;
  for (const Moving& m : moving) {
    const double own = least_of([&](double delay) { return misfit_m(*m.trial, m.held, delay); }, most_s);
    square += (own - out.delay_s) * (own - out.delay_s);
  }
  const auto count = static_cast<double>(moving.size());
  out.sd_s = count > 1 ? std::sqrt(square / (count - 1) / count) : most_s;
  return out;
}

std::string in_words(const HeldDelay& delay) {
  constexpr double kUnknown_s = 0.2;
  const double ms = 1e3 * std::abs(delay.delay_s), half = 1.645e3 * delay.sd_s;
  return fmt::format("the clock of the markers is {} by {:.1f} ms{} against the path of the grips",
                     delay.delay_s < 0 ? "early" : "late", ms,
                     delay.sd_s < kUnknown_s ? fmt::format(" ({:.1f} to {:.1f})", ms - half, ms + half) : "");
}

std::vector<double> marker_noise_m(const ObservedTrial& trial) {
  if (!trial.markers) return {};
  std::vector<double> out(trial.markers->uv.size(), trial.markers->noise_m);
  if (!is_outline_grid(trial)) return out;
  const Jumps jumps(trial, trial.experiment.path);
  for (size_t k = 0; k < out.size(); ++k) {
    const double down = trial.markers->uv[k].y() / trial.height_m,
                 across = 2 * trial.markers->uv[k].x() / trial.width_m - 1, both_edges = std::hypot(1 - down, down),
                 jump = both_edges * std::hypot(jumps.middle_m(), across * jumps.ends_m());
    out[k] = std::hypot(std::max(out[k], jumps.noise_m()), jump);
  }
  return out;
}

}  // namespace selvedge::model
