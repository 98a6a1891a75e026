// A square held by two corners, still or waved, simulated on 13 columns and seen as 25 noisy markers.
#pragma once

#include <cmath>
#include <random>
#include <string>

#include "capture/trial/trial.h"
#include "cloth/simulate.h"

namespace selvedge::fit {

inline constexpr double kSimulatedWidth_m = 0.3;
inline constexpr double kSimulatedNoise_m = 2e-4;

inline cloth::Material true_material() {
  cloth::Material m;
  m.density = 0.16;
  m.stretch = 90;
  m.shear = 45;
  m.bend = 8e-5;
  m.stretch_damping = m.shear_damping = 0.03;
  m.drag_normal = 1.3;
  return m;
}

// Right corner moved along y and z and back, 10 cm peak to peak at 1.5 Hz, after a short rest.
inline Eigen::Vector3d right_corner(double t, double amplitude) {
  const double w = t < 0.1 ? 0 : 0.5 * (1 - std::cos(2 * M_PI * 1.5 * (t - 0.1)));
  return {0.12, amplitude * w, 0.3 * amplitude * w};
}

inline trial::Trial simulated_trial(const std::string& name, double amplitude, double seconds, unsigned seed) {
  trial::Trial t;
  t.name = name;
  t.experiment = amplitude > 0 ? trial::Experiment::waving : trial::Experiment::static_hang;
  t.fabric = {"test knit", kSimulatedWidth_m, kSimulatedWidth_m, 0.16 * kSimulatedWidth_m * kSimulatedWidth_m, true};
  t.starts_at_rest = true;
  t.mocap_rate_hz = 120;
  t.mocap_noise_m = kSimulatedNoise_m;
  std::mt19937 generator(seed);
  std::normal_distribution<double> noise(0, kSimulatedNoise_m);
  const auto noisy = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d { return p + Eigen::Vector3d(noise(generator), noise(generator), noise(generator)); };
  const int samples = static_cast<int>(seconds * 120) + 1;
  Eigen::Matrix3Xd left(3, samples), right(3, samples);
  for (int i = 0; i < samples; ++i) {
    t.corners.time_s.push_back(i / 120.0);
    left.col(i) = Eigen::Vector3d(-0.12, 0, 0);
    right.col(i) = right_corner(i / 120.0, amplitude);
  }
  const cloth::Sheet sheet = cloth::make_sheet(geometry::make_grid_mesh(kSimulatedWidth_m, kSimulatedWidth_m, 13, 13));
  cloth::Experiment e;
  e.material = true_material();
  e.path = cloth::make_path(cloth::Hold::corners, t.corners.time_s, left, right);
  e.sample_s = t.corners.time_s;
  e.start_shape = cloth::hung_shape(sheet, e, 1);
  const cloth::Trajectory run = cloth::simulate(sheet, {e}).front();
  t.corners.left.resize(3, samples);
  t.corners.right.resize(3, samples);
  trial::Markers markers;
  std::vector<Eigen::Vector3d> seen;
  for (int i = 0; i < samples; ++i) {
    t.corners.left.col(i) = noisy(left.col(i));
    t.corners.right.col(i) = noisy(right.col(i));
    for (int k = 0; k < 25; ++k) {
      const int column = 1 + 5 * (k % 5) / 2, row = 1 + 5 * (k / 5) / 2;  // vertices 1, 3, 6, 8, 11
      markers.time_s.push_back(i / 120.0);
      markers.marker.push_back(k);
      markers.uv.emplace_back(kSimulatedWidth_m * column / 12, kSimulatedWidth_m * row / 12);
      seen.push_back(noisy(run.samples[static_cast<size_t>(i)].col(row * 13 + column)));
    }
  }
  markers.position.resize(3, static_cast<Eigen::Index>(seen.size()));
  for (size_t i = 0; i < seen.size(); ++i) markers.position.col(static_cast<Eigen::Index>(i)) = seen[i];
  t.markers = std::move(markers);
  return t;
}

}  // namespace selvedge::fit
