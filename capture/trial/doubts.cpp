#include "capture/trial/doubts.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "capture/trial/trial_summary.h"
#include "geometry/order_statistics.h"

namespace selvedge::trial {

namespace {

using Eigen::Index;
using Eigen::Vector3d;
using geometry::median;

constexpr double kGravity = 9.81;       // m/s²
constexpr double kStretched = 1.2;      // times its length: more is no fabric's strain under its own weight
constexpr double kHangs = 0.3;          // of how far a marker lies below the held edge on flat fabric
constexpr double kFastest_m_s = 10;     // of a marker
constexpr double kHeldWithin_m = 0.05;  // of a corner: a marker on it

std::string length(double m) {
  return std::abs(m) < 1 ? fmt::format("{:.3g} mm", 1e3 * m) : fmt::format("{:.4g} m", m);
}

// A unit that would make sense of a length that is so many times too large.
std::string unit_of(double times) {
  if (times > 300) return ": millimetres taken for metres?";
  if (times > 30) return ": centimetres taken for metres?";
  if (times < 0.003) return ": metres taken for millimetres?";
  return "";
}

Vector3d middle_of(const Corners& corners) {
  Vector3d sum = Vector3d::Zero();
  double count = 0;
  for (Index i = 0; i < corners.left.cols(); ++i) {
    const Vector3d middle = (corners.left.col(i) + corners.right.col(i)) / 2;
    if (!middle.allFinite()) continue;
    sum += middle;
    ++count;
  }
  return count > 0 ? Vector3d(sum / count) : Vector3d::Constant(std::nan(""));
}

void doubt_corners(const Trial& trial, std::vector<std::string>& out) {
  std::vector<double> apart;
  for (Index i = 0; i < trial.corners.left.cols(); ++i)
    if (const double d = (trial.corners.right.col(i) - trial.corners.left.col(i)).norm(); std::isfinite(d))
      apart.push_back(d);
  if (apart.empty()) return;
  const double d = median(apart), width = trial.fabric.width_m;
  if (d > kStretched * width)
    out.push_back(fmt::format("corners.csv: the held corners lie {} apart, expected at most the swatch's width of {}{}",
                              length(d), length(width), unit_of(d / width)));
  else if (d < 0.1 * width)
    out.push_back(fmt::format("corners.csv: the held corners lie {} apart, expected some share of the swatch's {}{}",
                              length(d), length(width), unit_of(d / width)));
}

void doubt_numbers(const Trial& trial, std::vector<std::string>& out) {
  const double gravity = trial.gravity_m_s2.norm(), mass = areal_mass(trial);
  if (std::abs(gravity - kGravity) > 0.1)
    out.push_back(
        fmt::format("trial.json gravity: found {:.4g} m/s², expected about {} (of the earth)", gravity, kGravity));
  if (mass < 0.005 || mass > 3)
    out.push_back(fmt::format("trial.json fabric: mass and size make {:.6g} g/m², expected 5 to 3000 as fabrics have",
                              1e3 * mass));
}

// What was seen lies below the held edge, along gravity; expected: how far in the mean on flat fabric, m.
void doubt_hanging(const Trial& trial, const char* file, const char* what, const Eigen::Matrix3Xd& position,
                   double expected, std::vector<std::string>& out) {
  if (position.cols() == 0 || !(expected > 0)) return;
  const Vector3d mean = position.rowwise().mean() - middle_of(trial.corners);
  if (!mean.allFinite()) return;
  const double drop = mean.dot(trial.gravity_m_s2.normalized());
  if (drop > kHangs * expected && mean.norm() < 3 * expected) return;
  std::string why = unit_of(mean.norm() / expected);
  Index axis = 0;
  if (why.empty() && mean.cwiseAbs().maxCoeff(&axis) > kHangs * expected)
    why = fmt::format(": they lie along {}{}; are axes changed over?", mean(axis) > 0 ? '+' : '-', "xyz"[axis]);
  out.push_back(fmt::format("{}: {} lie {} below the held corners along gravity, expected about {}{}", file, what,
                            length(drop), length(expected), why));
}

double mean_below_edge(const Markers& markers) {
  double flat = 0;
  for (const Eigen::Vector2d& uv : markers.uv) flat += uv.y() / static_cast<double>(markers.uv.size());
  return flat;
}

// Most points of a cloud lie no further from its middle than the swatch's corners do from its own.
void doubt_extent(const Trial& trial, const Surface& surface, std::vector<std::string>& out) {
  constexpr double kMost = 0.95;  // of the points
  const double half = 0.5 * std::hypot(trial.fabric.width_m, trial.fabric.height_m);
  std::vector<double> reaches;
  for (const Cloud& cloud : clouds(surface)) {
    const Eigen::VectorXd apart = (cloud.points.colwise() - cloud.points.rowwise().mean()).colwise().norm();
    std::vector<double> sorted(apart.begin(), apart.end());
    const auto most = sorted.begin() + static_cast<std::ptrdiff_t>(kMost * static_cast<double>(sorted.size()));
    std::nth_element(sorted.begin(), most, sorted.end());
    reaches.push_back(*most);
  }
  const double reach = median(reaches);
  if (reach <= kStretched * half) return;
  const std::string unit = unit_of(reach / half);
  out.push_back(fmt::format("surface.csv: points lie up to {} from their middle, expected at most {} of this swatch{}",
                            length(reach), length(half),
                            unit.empty() ? ": are there points of other things than the fabric?" : unit));
}

// Of each marker its rows, by time.
std::map<int, std::vector<size_t>> rows_of_markers(const Markers& markers) {
  std::map<int, std::vector<size_t>> out;
  for (size_t i = 0; i < markers.marker.size(); ++i) out[markers.marker[i]].push_back(i);
  return out;
}

double distance(const Markers& markers, size_t a, size_t b) {
  return (markers.position.col(static_cast<Index>(b)) - markers.position.col(static_cast<Index>(a))).norm();
}

// Fabric hardly stretches: markers lie no further apart than on it.
void doubt_distances(const Markers& markers, std::vector<std::string>& out) {
  std::map<double, std::vector<size_t>> at_time;
  for (size_t i = 0; i < markers.time_s.size(); ++i) at_time[markers.time_s[i]].push_back(i);
  std::vector<double> ratios;
  const size_t every = std::max<size_t>(1, at_time.size() / 20);
  size_t k = 0;
  for (const auto& [time, rows] : at_time) {
    if (k++ % every != 0) continue;
    for (size_t a = 0; a + 1 < rows.size(); ++a) {
      const double flat = (markers.uv[rows[a + 1]] - markers.uv[rows[a]]).norm();
      if (!(flat > 0)) continue;
      ratios.push_back(distance(markers, rows[a], rows[a + 1]) / flat);
    }
  }
  if (ratios.empty()) return;
  if (const double ratio = median(ratios); ratio > kStretched)
    out.push_back(fmt::format(
        "markers.csv: markers lie {:.3g} times as far apart as u and v say, expected at most 1 times{}", ratio,
        unit_of(ratio).empty() ? ": are u and v in metres, and of the right marker?" : unit_of(ratio)));
}

void doubt_speeds(const Markers& markers, std::vector<std::string>& out) {
  double most = 0, at_s = 0;
  int which = 0;
  size_t jumps = 0;
  for (const auto& [marker, rows] : rows_of_markers(markers))
    for (size_t i = 0; i + 1 < rows.size(); ++i) {
      const double step_s = markers.time_s[rows[i + 1]] - markers.time_s[rows[i]];
      if (!(step_s > 0)) continue;
      const double speed = distance(markers, rows[i], rows[i + 1]) / step_s;
      if (speed > kFastest_m_s) ++jumps;
      if (speed <= most) continue;
      most = speed;
      at_s = markers.time_s[rows[i]];
      which = marker;
    }
  if (jumps > 0)
    out.push_back(
        fmt::format("markers.csv: marker {} moves at {:.3g} m/s at {:.3f} s ({} such steps in all), expected "
                    "at most {}: are times in seconds, and marker numbers kept?",
                    which, most, at_s, jumps, kFastest_m_s));
}

// A marker on a held corner is where the corner is.
void doubt_held(const Trial& trial, const Markers& markers, std::vector<std::string>& out) {
  const auto corner_at = [&](bool is_left, double t) -> Vector3d {
    const auto at = std::lower_bound(trial.corners.time_s.begin(), trial.corners.time_s.end(), t);
    if (at == trial.corners.time_s.end()) return Vector3d::Constant(std::nan(""));
    return (is_left ? trial.corners.left : trial.corners.right).col(at - trial.corners.time_s.begin());
  };
  for (const bool is_left : {true, false}) {
    std::vector<double> away;
    int which = 0;
    for (size_t i = 0; i < markers.uv.size(); ++i) {
      const Eigen::Vector2d corner(is_left ? 0 : trial.fabric.width_m, 0);
      if ((markers.uv[i] - corner).norm() > 1e-3 * trial.fabric.width_m) continue;
      const double d = (markers.position.col(static_cast<Index>(i)) - corner_at(is_left, markers.time_s[i])).norm();
      if (std::isfinite(d)) away.push_back(d);
      which = markers.marker[i];
    }
    if (away.empty()) continue;
    if (const double d = median(away); d > kHeldWithin_m)
      out.push_back(
          fmt::format("markers.csv: marker {} is on the held {} corner and lies {} from it, expected at most "
                      "{}: left and right changed over, or other axes, or another clock?",
                      which, is_left ? "left" : "right", length(d), length(kHeldWithin_m)));
  }
}

// Observations of times in which no corner was seen have no motion to compare them with.
void doubt_clock(const Trial& trial, const char* file, const std::vector<double>& times_s,
                 std::vector<std::string>& out) {
  if (times_s.empty() || trial.corners.time_s.empty()) return;
  const double from = trial.corners.time_s.front(), to = trial.corners.time_s.back();
  const auto inside = std::count_if(times_s.begin(), times_s.end(), [&](double t) { return t >= from && t <= to; });
  if (2 * static_cast<size_t>(inside) >= times_s.size()) return;
  const auto [first, last] = std::minmax_element(times_s.begin(), times_s.end());
  out.push_back(
      fmt::format("{}: {} of {} times lie within those of corners.csv ({:.3f} to {:.3f} s), expected all; "
                  "found {:.3f} to {:.3f} s: another clock, or milliseconds?",
                  file, inside, times_s.size(), from, to, *first, *last));
}

}  // namespace

std::vector<std::string> doubts(const Trial& trial) {
  std::vector<std::string> out;
  if (is_material_test(trial.experiment)) return out;
  doubt_corners(trial, out);
  doubt_numbers(trial, out);
  if (trial.frames) doubt_clock(trial, "frames.csv", trial.frames->time_s, out);
  if (trial.surface) {
    doubt_clock(trial, "surface.csv", trial.surface->time_s, out);
    doubt_hanging(trial, "surface.csv", "points", trial.surface->position, 0.5 * trial.fabric.height_m, out);
    doubt_extent(trial, *trial.surface, out);
  }
  if (!trial.markers) return out;
  doubt_clock(trial, "markers.csv", trial.markers->time_s, out);
  doubt_hanging(trial, "markers.csv", "markers", trial.markers->position, mean_below_edge(*trial.markers), out);
  doubt_distances(*trial.markers, out);
  doubt_speeds(*trial.markers, out);
  doubt_held(trial, *trial.markers, out);
  return out;
}

std::vector<std::string> doubts(const Campaign& campaign) {
  std::vector<std::string> out;
  for (const Trial& trial : campaign.trials)
    for (const std::string& doubt : doubts(trial)) out.push_back(trial.name + ": " + doubt);
  return out;
}

}  // namespace selvedge::trial
