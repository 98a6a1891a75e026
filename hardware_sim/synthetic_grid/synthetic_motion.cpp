#include "hardware_sim/synthetic_grid/synthetic_motion.h"

#include <cmath>
#include <random>

namespace selvedge::hardware_sim {

SyntheticMotion make_synthetic_motion(const geometry::Projection& camera, const Eigen::Vector3d& middle,
                                      const MotionOptions& options) {
  std::mt19937 generator(options.seed);
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> unit(0, 1);
  SyntheticMotion motion;
  for (int marker = 0; marker < options.markers; ++marker) {
    const Eigen::Vector3d place =
        middle + Eigen::Vector3d(0.2 * (marker % 2) - 0.1, 0.05 * marker, 0.2 * (marker / 2 % 2) - 0.1);
    const double phase = 0.8 * marker;
    const auto at = [&](double t) {
      const double angle = 2 * M_PI * options.frequency_hz * t + phase;
      return Eigen::Vector3d(place + options.amplitude_m * Eigen::Vector3d(std::sin(angle), 0.3 * std::cos(0.7 * angle),
                                                                           0.5 * std::sin(1.3 * angle)));
    };
    calib::MarkerTrack track{marker, {}, {}};
    for (int i = 0; i < options.duration_s * options.tracker_rate_hz; ++i) {
      const double t = i / options.tracker_rate_hz;
      track.time_s.push_back(t);
      Eigen::Vector3d seen = at(t);
      for (int axis = 0; axis < 3; ++axis) seen[axis] += options.tracker_noise_m * normal(generator);
      track.position.push_back(seen);
    }
    motion.tracks.push_back(track);
    for (int i = 0; i < options.duration_s * options.camera_rate_hz; ++i) {
      const double t = i / options.camera_rate_hz;
      Eigen::Vector2d pixel = geometry::project(camera, at(t + options.offset_s));
      for (int axis = 0; axis < 2; ++axis) pixel[axis] += options.camera_noise_px * normal(generator);
      if (unit(generator) < options.outlier_share)
        pixel += Eigen::Vector2d(80 * normal(generator), 80 * normal(generator));
      motion.sightings.push_back({t, marker, pixel});
    }
  }
  return motion;
}

}  // namespace selvedge::hardware_sim
