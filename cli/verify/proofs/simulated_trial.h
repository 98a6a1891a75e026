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

// Its motion, and the trial of it without what saw the fabric. The noise of the corners and of what is seen follow one
// another out of one generator.
struct SimulatedRun {
  trial::Trial trial;
  cloth::spline::SplineSheet sheet;
  cloth::Trajectory run;
  std::mt19937 generator;
  std::normal_distribution<double> noise;

  Eigen::Vector3d noisy(const Eigen::Vector3d& p) {
    return p + Eigen::Vector3d(noise(generator), noise(generator), noise(generator));
  }
  // Control points at a sample, seen so much late.
  Eigen::Matrix3Xd shape(int sample, double delay_s) const {
    const double at = std::max(0.0, sample - 120 * delay_s);
    const auto k = static_cast<size_t>(at);
    const double share = at - static_cast<double>(k);
    return (1 - share) * run.samples[k] + share * run.samples[std::min(k + 1, run.samples.size() - 1)];
  }
};

inline SimulatedRun simulated_run(const SimulatedSwatch& c, const SimulatedMotion& motion, const std::string& name,
                                  unsigned seed) {
  constexpr double kWidth = 0.3;
  trial::Trial t;
  t.name = name;
  t.experiment = motion.amplitude_m > 0 ? trial::Experiment::waving : trial::Experiment::static_hang;
  t.fabric = {"test knit", kWidth, kWidth, c.material.density * kWidth * kWidth, true};
  t.starts_at_rest = true;
  t.mocap_rate_hz = 120;
  t.mocap_noise_m = c.noise_m;
  t.corners.left.resize(3, motion.samples);
  t.corners.right.resize(3, motion.samples);
  for (int i = 0; i < motion.samples; ++i) {
    const double s = i / 120.0, w = s < 0.1 ? 0 : 0.5 * (1 - std::cos(2 * M_PI * motion.frequency_hz * (s - 0.1)));
    t.corners.time_s.push_back(s);
    t.corners.left.col(i) = Eigen::Vector3d(-motion.half_apart_m, 0, 0);
    t.corners.right.col(i) = Eigen::Vector3d(motion.half_apart_m, motion.amplitude_m * w, 0.3 * motion.amplitude_m * w);
  }
  const cloth::spline::Swatch swatch{kWidth, kWidth, c.grip_m};
  cloth::spline::SplineSheet sheet =
      make_spline_sheet(swatch, make_grid(swatch, cloth::Hold::corners, kWidth / c.cells));
  cloth::Experiment e;
  e.material = c.material;
  e.air_velocity_m_s = c.air_m_s;
  e.path = cloth::make_path(cloth::Hold::corners, t.corners.time_s, t.corners.left, t.corners.right);
  e.sample_s = t.corners.time_s;
  e.start_shape = hung_shape(sheet, e, 1);
  cloth::Trajectory run = simulate(sheet, {e}).front();
  return {std::move(t), std::move(sheet), std::move(run), std::mt19937(seed),
          std::normal_distribution<double>(0, c.noise_m)};
}

inline trial::Trial simulated_trial(const SimulatedSwatch& c, const SimulatedMotion& motion, const std::string& name,
                                    unsigned seed) {
  SimulatedRun r = simulated_run(c, motion, name, seed);
  trial::Trial& t = r.trial;
  const double width = t.fabric.width_m;
  trial::Markers markers;
  std::vector<Eigen::Vector3d> seen;
  for (int i = 0; i < motion.samples; ++i) {
    t.corners.left.col(i) = r.noisy(t.corners.left.col(i));
    t.corners.right.col(i) = r.noisy(t.corners.right.col(i));
    const Eigen::Matrix3Xd shape = r.shape(i, c.delay_s);
    for (int m = 0; m < 25; ++m) {
      markers.time_s.push_back(i / 120.0);
      markers.marker.push_back(m);
      markers.uv.emplace_back(width * (0.08 + 0.21 * (m % 5)), width * (0.08 + 0.21 * (m / 5)));
      seen.push_back(r.noisy(position_of(surface_point(r.sheet, markers.uv.back()), shape)));
    }
  }
  markers.position.resize(3, static_cast<Eigen::Index>(seen.size()));
  for (size_t i = 0; i < seen.size(); ++i) markers.position.col(static_cast<Eigen::Index>(i)) = seen[i];
  t.markers = std::move(markers);
  return t;
}

}  // namespace selvedge
