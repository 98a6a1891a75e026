// A trial that the model itself simulates: a square of 0.3 m held by two corners, still or waved, seen as 25
// noisy markers.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "capture/trial/trial.h"
#include "cli/verify/proofs/proof_fabric.h"
#include "cloth/spline/simulate.h"

namespace selvedge {

struct SimulatedSwatch {
  cloth::Material material = cli::proof_fabric();
  double delay_s = 0;     // of the markers
  double noise_m = 2e-4;  // of a coordinate, one standard deviation
  int cells = 9;          // along the width
  double grip_m = cloth::spline::Swatch().grip_m;
  Eigen::Vector3d air_m_s = Eigen::Vector3d::Zero();
};

// The right corner goes along y and z and back, after a short rest. amplitude_m: along y, peak to peak; 0 hangs still.
struct SimulatedMotion {
  double half_apart_m = 0.12, amplitude_m = 0, frequency_hz = 1.5;
  int samples = 13;  // at 120 Hz
};

inline trial::Trial simulated_trial(const SimulatedSwatch& c, const SimulatedMotion& motion, const std::string& name,
                                    unsigned seed) {
  constexpr double kWidth = 0.3;
  trial::Trial t;
  t.name = name;
  t.experiment = motion.amplitude_m > 0 ? trial::Experiment::waving : trial::Experiment::static_hang;
  t.fabric = {"test knit", kWidth, kWidth, c.material.density * kWidth * kWidth, true};
  t.starts_at_rest = true;
  t.mocap_rate_hz = 120;
  t.mocap_noise_m = c.noise_m;
  std::mt19937 generator(seed);
  std::normal_distribution<double> noise(0, c.noise_m);
  const auto noisy = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return p + Eigen::Vector3d(noise(generator), noise(generator), noise(generator));
  };
  Eigen::Matrix3Xd left(3, motion.samples), right(3, motion.samples);
  for (int i = 0; i < motion.samples; ++i) {
    const double s = i / 120.0, w = s < 0.1 ? 0 : 0.5 * (1 - std::cos(2 * M_PI * motion.frequency_hz * (s - 0.1)));
    t.corners.time_s.push_back(s);
    left.col(i) = Eigen::Vector3d(-motion.half_apart_m, 0, 0);
    right.col(i) = Eigen::Vector3d(motion.half_apart_m, motion.amplitude_m * w, 0.3 * motion.amplitude_m * w);
  }
  const cloth::spline::Swatch swatch{kWidth, kWidth, c.grip_m};
  const cloth::spline::SplineSheet sheet =
      make_spline_sheet(swatch, make_grid(swatch, cloth::Hold::corners, kWidth / c.cells));
  cloth::Experiment e;
  e.material = c.material;
  e.air_velocity_m_s = c.air_m_s;
  e.path = cloth::make_path(cloth::Hold::corners, t.corners.time_s, left, right);
  e.sample_s = t.corners.time_s;
  e.start_shape = hung_shape(sheet, e, 1);
  const cloth::Trajectory run = simulate(sheet, {e}).front();
  t.corners.left.resize(3, motion.samples);
  t.corners.right.resize(3, motion.samples);
  trial::Markers markers;
  std::vector<Eigen::Vector3d> seen;
  for (int i = 0; i < motion.samples; ++i) {
    t.corners.left.col(i) = noisy(left.col(i));
    t.corners.right.col(i) = noisy(right.col(i));
    const double at = std::max(0.0, i - 120 * c.delay_s);
    const auto k = static_cast<size_t>(at);
    const double share = at - static_cast<double>(k);
    const Eigen::Matrix3Xd shape =
        (1 - share) * run.samples[k] + share * run.samples[std::min(k + 1, run.samples.size() - 1)];
    for (int m = 0; m < 25; ++m) {
      markers.time_s.push_back(i / 120.0);
      markers.marker.push_back(m);
      markers.uv.emplace_back(kWidth * (0.08 + 0.21 * (m % 5)), kWidth * (0.08 + 0.21 * (m / 5)));
      seen.push_back(noisy(position_of(surface_point(sheet, markers.uv.back()), shape)));
    }
  }
  markers.position.resize(3, static_cast<Eigen::Index>(seen.size()));
  for (size_t i = 0; i < seen.size(); ++i) markers.position.col(static_cast<Eigen::Index>(i)) = seen[i];
  t.markers = std::move(markers);
  return t;
}

}  // namespace selvedge
