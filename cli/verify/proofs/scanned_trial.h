// A trial that the model itself simulates, seen by a depth camera: clouds of noisy points, others at each time.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "cli/verify/proofs/simulated_trial.h"
#include "cloth/spline/view.h"
#include "geometry/projection.h"
#include "render/row_map.h"

namespace selvedge {

// The camera stands 1.1 m in front of the hung swatch, at its height.
struct DepthCamera {
  double noise_m = 1.5e-3;   // of a distance along a ray, one standard deviation
  double delay_s = 0;        // of its stamps
  double px_apart_m = 3e-3;  // of neighbouring rays, on the fabric
  int every = 4;             // sample of the motion
  Eigen::Vector3d from_m = Eigen::Vector3d(0.1, -1.1, -0.15);
};

inline trial::Trial scanned_trial(const SimulatedSwatch& c, const SimulatedMotion& motion, const DepthCamera& by,
                                  const std::string& name, unsigned seed) {
  SimulatedRun r = simulated_run(c, motion, name, seed);
  constexpr int kSide_px = 240;
  const Eigen::Vector3d middle(0, 0, -0.15);
  const geometry::Projection camera =
      geometry::looking_at(by.from_m, middle, (middle - by.from_m).norm() / by.px_apart_m, kSide_px, kSide_px);
  const cloth::spline::View view(r.sheet, 8);
  render::RowMap map(camera, camera);
  std::normal_distribution<double> along_ray(0, by.noise_m);
  trial::Surface surface;
  surface.seen_from_m = by.from_m;
  std::vector<Eigen::Vector3d> seen;
  std::vector<float> row, column, depth;
  for (int i = 0; i < motion.samples; ++i) {
    r.trial.corners.left.col(i) = r.noisy(r.trial.corners.left.col(i));
    r.trial.corners.right.col(i) = r.noisy(r.trial.corners.right.col(i));
    if (i % by.every != 0) continue;
    map.rasterise(view.of(r.shape(i, by.delay_s)), view.mesh().triangles);
    map.fill(row, column, depth);
    for (size_t k = 0; k < depth.size(); ++k) {
      if (!std::isfinite(depth[k])) continue;
      const Eigen::Vector2d pixel(static_cast<double>(k % kSide_px), static_cast<double>(k / kSide_px));
      const Eigen::Vector3d ray = geometry::ray(camera, pixel);
      const double cosine = ray.dot((middle - by.from_m).normalized());
      surface.time_s.push_back(i / 120.0);
      seen.push_back(by.from_m + (static_cast<double>(depth[k]) / cosine + along_ray(r.generator)) * ray);
    }
  }
  surface.position = Eigen::Map<const Eigen::Matrix3Xd>(seen.front().data(), 3, static_cast<Eigen::Index>(seen.size()));
  r.trial.surface = std::move(surface);
  return std::move(r.trial);
}

}  // namespace selvedge
