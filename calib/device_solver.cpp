#include "calib/device_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <fmt/format.h>

namespace selvedge::calib {

namespace {

constexpr size_t kLeastSightings = 12;
constexpr double kUndeterminedRatio = 0.5;  // least / second least singular value; 0.01 is usual

// Least and largest standard deviation of points along their principal axes, m.
std::pair<double, double> extents(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::Vector3d values =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter / static_cast<double>(points.size())).eigenvalues();
  return {std::sqrt(std::max(values[0], 0.0)), std::sqrt(std::max(values[2], 0.0))};
}

bool flat(const std::vector<Eigen::Vector3d>& points, double tracker_noise_m) {
  if (points.size() < 5) return true;
  const auto [least, largest] = extents(points);
  return least < std::max(4 * tracker_noise_m, 0.02 * largest);
}

bool contains(const std::vector<int>& values, int value) {
  return std::find(values.begin(), values.end(), value) != values.end();
}

// Marks the sightings within the gate, those of excluded poses aside; true where that changed something.
bool gate(RefineInput& input, const Refined& refined, const std::vector<int>& excluded, double gate_sd) {
  const std::vector<double> squares = whitened_squares(refined, input);
  bool changed = false;
  for (size_t i = 0; i < squares.size(); ++i) {
    const Sighting& s = (*input.sightings)[i];
    const char used =
        squares[i] < gate_sd * gate_sd && !contains(excluded, s.pose) && depth_of(refined.camera, s.point) > 0;
    changed |= used != input.used[i];
    input.used[i] = used;
  }
  return changed;
}

size_t count_used(const RefineInput& input) {
  return static_cast<size_t>(std::count(input.used.begin(), input.used.end(), 1));
}

// Refinement and gate in turn until the trusted sightings no longer change.
void settle(RefineInput& input, Refined& refined, const std::vector<int>& excluded, double gate_sd, Loss loss) {
  for (int round = 0; round < 10; ++round) {
    if (count_used(input) < kLeastSightings) return;
    refined = refine(input, refined, loss);
    if (!gate(input, refined, excluded, gate_sd)) return;
  }
}

// k3 is freed only where the data ask for it; with a single pose the order with the least AIC is taken.
// Dropping p1 and p2 by a test would leave their bias out of the covariance.
void choose_order(RefineInput& input, Refined& refined) {
  const bool one_pose = poses_of(*input.sightings).size() < 2;
  const double price = one_pose ? 2 : 5;  // χ² that a parameter must save
  input.order = DistortionOrder::k1_k2_p1_p2_k3;
  const Refined fullest = refine(input, refined, Loss::square);
  double best = std::numeric_limits<double>::infinity();
  DistortionOrder chosen = DistortionOrder::k1_k2_p1_p2;
  for (const DistortionOrder order :
       {DistortionOrder::none, DistortionOrder::k1_k2, DistortionOrder::k1_k2_p1_p2, DistortionOrder::k1_k2_p1_p2_k3}) {
    if (!one_pose && order < DistortionOrder::k1_k2_p1_p2) continue;
    input.order = order;
    Refined start = order == DistortionOrder::k1_k2_p1_p2_k3 ? fullest : refined;
    for (int i = static_cast<int>(order); i < 5; ++i) start.camera[kDistortion + i] = 0;
    Refined candidate = refine(input, start, Loss::square);
    candidate.pixel_sd_px = fullest.pixel_sd_px;
    const std::vector<double> squares = whitened_squares(candidate, input);
    double criterion = price * static_cast<double>(order);
    for (size_t i = 0; i < squares.size(); ++i) criterion += input.used[i] ? squares[i] : 0;
    if (criterion < best) {
      best = criterion;
      chosen = order;
    }
  }
  input.order = chosen;
  for (int i = static_cast<int>(chosen); i < 5; ++i) refined.camera[kDistortion + i] = 0;
}

double residual_px(const DeviceSolution& d, const Refined& refined, const Sighting& s) {
  return (pixel_of(refined.camera, s.point, shift_for(refined, d.input.stage_starts, s.pose)) - s.pixel).norm();
}

// Says of a sighting that is not trusted what is likely wrong with it.
std::string reason(const DeviceSolution& d, const std::string& name, const Sighting& stray) {
  for (const PoseEvent& event : d.events)
    if (!event.knocked && event.pose == stray.pose)
      return fmt::format(
          "{}: pose {} does not fit the others (the board or the {} moved between the {}'s look and "
          "the tracker's)",
          name, stray.pose, name, name);
  for (const Sighting& other : d.seen()) {
    if (other.pose != stray.pose || other.marker == stray.marker) continue;
    const PixelDerivatives at =
        derivatives(d.refined.camera, other.point, shift_for(d.refined, d.input.stage_starts, other.pose));
    const Eigen::Vector2d off = at.pixel - stray.pixel;
    const Eigen::Matrix2d covariance = sighting_covariance(at, d.refined.pixel_sd_px, d.input.tracker_noise_m);
    if (off.dot(covariance.inverse() * off) < 25)
      return fmt::format("{}: wrong label, the pixel is that of marker {}", name, other.marker);
  }
  return fmt::format("{}: {:.1f} px from where it should be", name, residual_px(d, d.refined, stray));
}

void fill_residual_summary(DeviceSolution& d, const std::string& name) {
  std::map<int, std::pair<double, int>> by_pose, by_marker;
  double sum = 0;
  for (size_t i = 0; i < d.seen().size(); ++i) {
    const Sighting& s = d.seen()[i];
    if (!d.input.used[i]) {
      d.rejected.push_back({s.pose, s.marker, reason(d, name, s)});
      continue;
    }
    const double squared = std::pow(residual_px(d, d.refined, s), 2);
    sum += squared;
    by_pose[s.pose].first += squared;
    ++by_pose[s.pose].second;
    by_marker[s.marker].first += squared;
    ++by_marker[s.marker].second;
  }
  d.rms_px = std::sqrt(sum / std::max<double>(1, static_cast<double>(count_used(d.input))));
  for (const auto& [pose, value] : by_pose) d.pose_rms_px[pose] = std::sqrt(value.first / value.second);
  for (const auto& [marker, value] : by_marker) d.marker_rms_px[marker] = std::sqrt(value.first / value.second);
}

// A moved pose, thrown out whole, still has its residual: under the fit without it.
void add_moved_poses(DeviceSolution& d) {
  for (const PoseEvent& event : d.events) {
    if (event.knocked) continue;
    double sum = 0;
    int count = 0;
    for (const Sighting& s : d.seen())
      if (s.pose == event.pose) {
        sum += std::pow(residual_px(d, d.refined, s), 2);
        ++count;
      }
    if (count > 0) d.pose_rms_px[event.pose] = d.left_out_rms_px[event.pose] = std::sqrt(sum / count);
  }
}

void leave_one_pose_out(DeviceSolution& d) {
  double total = 0;
  int total_count = 0;
  for (const auto& [pose, rms] : std::map<int, double>(d.pose_rms_px)) {
    RefineInput without = d.input;
    for (size_t i = 0; i < without.used.size(); ++i)
      if (d.seen()[i].pose == pose) without.used[i] = 0;
    if (count_used(without) < kLeastSightings) continue;
    const Refined refined = refine(without, d.refined, Loss::square);
    double sum = 0;
    int count = 0;
    for (size_t i = 0; i < d.seen().size(); ++i)
      if (d.input.used[i] && d.seen()[i].pose == pose) {
        sum += std::pow(residual_px(d, refined, d.seen()[i]), 2);
        ++count;
      }
    if (count == 0) continue;
    d.left_out_rms_px[pose] = std::sqrt(sum / count);
    total += sum;
    total_count += count;
  }
  d.leave_one_pose_out_px = total_count > 0 ? std::sqrt(total / total_count) : std::numeric_limits<double>::quiet_NaN();
}

int place_of_largest(const std::map<int, double>& values) {
  const auto found =
      std::max_element(values.begin(), values.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return found == values.end() ? 0 : found->first;
}

// Linear start and robust refinement; false where no projection explains the sightings.
bool first_fit(DeviceSolution& d, const DeviceOptions& options) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  for (const Sighting& s : d.seen()) {
    points.push_back(s.point);
    pixels.push_back(s.pixel);
  }
  RansacOptions ransac = options.ransac;
  ransac.threshold_px = std::max(ransac.threshold_px * d.size.width_px / 1280.0, 6.0);
  const LinearProjection linear = ransac_projection(points, pixels, ransac);
  d.input.used = linear.inlier;
  if (count_used(d.input) < kLeastSightings || linear.inlier_share < 0.4) return false;
  geometry::Projection start;
  start.matrix = linear.matrix;
  try {
    d.refined.camera = from_projection(start);
  } catch (const std::invalid_argument&) { return false; }
  d.refined.pixel_sd_px = 2;
  d.input.order = DistortionOrder::k1_k2_p1_p2;
  settle(d.input, d.refined, {}, options.gate_sd, Loss::cauchy);
  return count_used(d.input) >= kLeastSightings;
}

// Moved poses are left out, a knock opens a stage; each time everything is fitted again.
void resolve_events(DeviceSolution& d, std::vector<int>& excluded, const DeviceOptions& options) {
  const size_t most_events = 4;
  while (d.events.size() < most_events) {
    const auto event = find_event(d.input, d.refined, excluded, options.events);
    if (!event) return;
    if (event->knocked) {
      const auto place = std::lower_bound(d.input.stage_starts.begin(), d.input.stage_starts.end(), event->pose);
      const auto index = place - d.input.stage_starts.begin();
      d.input.stage_starts.insert(place, event->pose);
      // The stage that is cut in two keeps its shift in both halves, to start from.
      const bool was_last = index == static_cast<std::ptrdiff_t>(d.refined.earlier.size());
      const PoseShift start = was_last ? PoseShift(PoseShift::Zero()) : d.refined.earlier[index];
      d.refined.earlier.insert(d.refined.earlier.begin() + index, start);
    } else {
      excluded.push_back(event->pose);
    }
    d.events.push_back(*event);
    // Everything not excluded gets a new chance: the noise starts wide again.
    for (size_t i = 0; i < d.seen().size(); ++i) d.input.used[i] = !contains(excluded, d.seen()[i].pose);
    settle(d.input, d.refined, excluded, options.gate_sd, Loss::cauchy);
    if (count_used(d.input) < kLeastSightings) return;
  }
}

void describe_events(DeviceSolution& d) {
  for (PoseEvent& event : d.events) {
    if (event.knocked) {
      const PoseShift* before = shift_for(d.refined, d.input.stage_starts, event.pose - 1);
      if (before) event.shift = *before;
    } else {
      event.shift = fit_pose_shift(d.input, d.refined, event.pose).shift;
    }
  }
}

// Of the stage with the most sightings: a linear projection knows of no knock.
double linear_ratio(const DeviceSolution& d) {
  std::map<int, int> in_stage;
  for (const Sighting& s : d.seen()) ++in_stage[stage_of(d.input.stage_starts, s.pose)];
  const int stage = std::max_element(in_stage.begin(), in_stage.end(), [](const auto& a, const auto& b) {
                      return a.second < b.second;
                    })->first;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  for (size_t i = 0; i < d.seen().size(); ++i)
    if (d.input.used[i] && stage_of(d.input.stage_starts, d.seen()[i].pose) == stage) {
      points.push_back(d.seen()[i].point);
      pixels.push_back(d.seen()[i].pixel);
    }
  return points.size() < 6 ? 1 : direct_linear_transform(points, pixels).singular_ratio;
}

}  // namespace

bool all_on_one_plane(const std::vector<Sighting>& sightings, double tracker_noise_m) {
  std::vector<Eigen::Vector3d> points;
  for (const Sighting& s : sightings) points.push_back(s.point);
  return flat(points, tracker_noise_m);
}

bool flat_in_every_pose(const std::vector<Sighting>& sightings, double tracker_noise_m) {
  std::map<int, std::vector<Eigen::Vector3d>> by_pose;
  for (const Sighting& s : sightings) by_pose[s.pose].push_back(s.point);
  return std::all_of(by_pose.begin(), by_pose.end(),
                     [&](const auto& pose) { return flat(pose.second, tracker_noise_m); });
}

DeviceSolution solve_device(const std::string& name, std::vector<Sighting> sightings, const ImageSize& size,
                            double tracker_noise_m, const DeviceOptions& options) {
  DeviceSolution d;
  d.size = size;
  d.input.sightings = std::make_shared<const std::vector<Sighting>>(std::move(sightings));
  d.input.used.assign(d.input.sightings->size(), 0);
  d.input.tracker_noise_m = tracker_noise_m;
  d.leave_one_pose_out_px = std::numeric_limits<double>::quiet_NaN();
  if (d.seen().size() < kLeastSightings) {
    d.degeneracy = Degeneracy::too_few;
    return d;
  }
  if (all_on_one_plane(d.seen(), tracker_noise_m)) {
    d.degeneracy = Degeneracy::one_plane;
    return d;
  }
  if (!first_fit(d, options)) {
    d.degeneracy = Degeneracy::inconsistent;
    return d;
  }
  std::vector<int> excluded;
  if (options.find_events) resolve_events(d, excluded, options);
  settle(d.input, d.refined, excluded, options.gate_sd, Loss::square);
  if (options.choose_distortion) choose_order(d.input, d.refined);
  else d.input.order = DistortionOrder::k1_k2_p1_p2;
  settle(d.input, d.refined, excluded, options.gate_sd, Loss::square);
  if (count_used(d.input) < kLeastSightings) {
    d.degeneracy = Degeneracy::inconsistent;
    return d;
  }
  d.solved = true;
  d.uncertainty = uncertainty(d.input, d.refined);
  d.singular_ratio = linear_ratio(d);
  describe_events(d);
  fill_residual_summary(d, name);
  if (options.leave_one_pose_out) leave_one_pose_out(d);
  add_moved_poses(d);
  d.worst_pose = place_of_largest(d.left_out_rms_px.empty() ? d.pose_rms_px : d.left_out_rms_px);
  d.worst_marker = place_of_largest(d.marker_rms_px);
  if (poses_of(d.seen()).size() < 2) d.degeneracy = Degeneracy::one_pose;
  else if (flat_in_every_pose(d.seen(), tracker_noise_m)) d.degeneracy = Degeneracy::flat_grid;
  else if (!d.uncertainty.determined || d.singular_ratio > kUndeterminedRatio) d.degeneracy = Degeneracy::undetermined;
  return d;
}

}  // namespace selvedge::calib
