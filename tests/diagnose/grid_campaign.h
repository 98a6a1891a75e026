// A swatch that hangs from a moving bar, simulated by the model itself and seen as the nodes of a grid inside its
// outline, by a tracker with a fault of its own.
#pragma once

#include <functional>
#include <random>
#include <string>

#include "cli/verify/proofs/simulated_trial.h"

namespace selvedge::diagnose {

// The fabric: where the point uv (m) is at a time (s), m.
using Surface = std::function<Eigen::Vector3d(const Eigen::Vector2d& uv, double t_s)>;

// What a tracker says of the node uv at a time, before noise.
using Tracker = std::function<Eigen::Vector3d(const Surface& surface, const Eigen::Vector2d& uv, double t_s)>;

struct GridTrial {
  double amplitude_m = 0, frequency_hz = 1.5;
  int samples = 97;                               // at 120 Hz
  std::function<Tracker(unsigned seed)> tracker;  // of one trial
  double bar_m = 0.3;
};

inline constexpr double kGridWidth_m = 0.3;
inline constexpr int kGridNodes = 6;  // a side

inline trial::Trial grid_trial(const GridTrial& g, const std::string& name, unsigned seed) {
  SimulatedSwatch c;
  c.material.stretch = 90;
  c.material.shear = 45;
  c.material.bend = 6e-5;
  trial::Trial t;
  t.name = name;
  t.experiment = g.amplitude_m > 0 ? trial::Experiment::robot : trial::Experiment::static_hang;
  t.held = trial::Held::top_edge;
  t.fabric = {"test knit", kGridWidth_m, kGridWidth_m, c.material.density * kGridWidth_m * kGridWidth_m, true};
  t.starts_at_rest = true;
  t.mocap_rate_hz = 120;
  t.mocap_noise_m = c.noise_m;
  t.camera = geometry::looking_at({0.2, -1.5, 0.1}, {0, 0, -0.15}, 900, 640, 480);
  const auto count = static_cast<Eigen::Index>(g.samples);
  Eigen::Matrix3Xd left(3, count), right(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double s = static_cast<double>(i) / 120, phase = 2 * M_PI * g.frequency_hz * (s - 0.1);
    const double w = s < 0.1 ? 0 : 0.5 * (1 - std::cos(phase));
    t.corners.time_s.push_back(s);
    const Eigen::Vector3d middle(0.2 * g.amplitude_m * w, g.amplitude_m * w, 0.1 * g.amplitude_m * w);
    left.col(i) = middle - Eigen::Vector3d(0.5 * g.bar_m, 0, 0);
    right.col(i) = middle + Eigen::Vector3d(0.5 * g.bar_m, 0, 0);
  }
  const cloth::spline::Swatch swatch{kGridWidth_m, kGridWidth_m, c.grip_m};
  const cloth::spline::SplineSheet sheet =
      make_spline_sheet(swatch, make_grid(swatch, cloth::Hold::top_edge, kGridWidth_m / c.cells));
  cloth::Experiment e;
  e.material = c.material;
  e.path = cloth::make_path(cloth::Hold::top_edge, t.corners.time_s, left, right);
  e.sample_s = t.corners.time_s;
  e.start_shape = hung_shape(sheet, e, 1);
  const cloth::Trajectory run = simulate(sheet, {e}).front();
  const Surface surface = [&](const Eigen::Vector2d& uv, double s) -> Eigen::Vector3d {
    const double at = std::clamp(120 * s, 0.0, static_cast<double>(count - 1));
    const auto k = std::min(static_cast<size_t>(at), run.samples.size() - 2);
    const double share = at - static_cast<double>(k);
    const cloth::SurfacePoint point = surface_point(sheet, uv);
    return (1 - share) * position_of(point, run.samples[k]) + share * position_of(point, run.samples[k + 1]);
  };
  const Tracker tracker = g.tracker(seed);
  std::mt19937 generator(seed);
  std::normal_distribution<double> noise(0, c.noise_m);
  const auto noisy = [&](const Eigen::Vector3d& x) -> Eigen::Vector3d {
    return x + Eigen::Vector3d(noise(generator), noise(generator), noise(generator));
  };
  t.corners.left.resize(3, count);
  t.corners.right.resize(3, count);
  trial::Markers markers;
  markers.position.resize(3, count * kGridNodes * kGridNodes);
  Eigen::Index at = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    t.corners.left.col(i) = noisy(left.col(i));
    t.corners.right.col(i) = noisy(right.col(i));
    for (int k = 0; k < kGridNodes * kGridNodes; ++k) {
      markers.time_s.push_back(t.corners.time_s[static_cast<size_t>(i)]);
      markers.marker.push_back(k);
      markers.uv.emplace_back(kGridWidth_m * (k % kGridNodes) / (kGridNodes - 1),
                              kGridWidth_m * (k / kGridNodes) / (kGridNodes - 1));
      markers.position.col(at++) = noisy(tracker(surface, markers.uv.back(), markers.time_s.back()));
    }
  }
  t.markers = std::move(markers);
  return t;
}

inline trial::Campaign grid_campaign(const std::function<Tracker(unsigned seed)>& tracker) {
  trial::Campaign campaign;
  campaign.folder = "simulated";
  campaign.fabric = "test knit";
  campaign.trials = {grid_trial({.samples = 12, .tracker = tracker}, "static-1", 1),
                     grid_trial({.amplitude_m = 0.12, .frequency_hz = 1.4, .tracker = tracker}, "robot-1", 2),
                     grid_trial({.amplitude_m = 0.09, .frequency_hz = 2.0, .tracker = tracker}, "robot-2", 3)};
  return campaign;
}

}  // namespace selvedge::diagnose
