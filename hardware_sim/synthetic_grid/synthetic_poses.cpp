#include "hardware_sim/synthetic_grid/synthetic_poses.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "calib/predicted_deviation.h"

namespace selvedge::hardware_sim {

namespace {

Eigen::Isometry3d draw_pose(const SyntheticOptions& options, const calib::Poses& poses, std::mt19937& generator) {
  std::uniform_real_distribution<double> unit(-1, 1);
  const Eigen::Vector3d middle = (poses.volume_low + poses.volume_high) / 2;
  const Eigen::Vector3d reach = 0.32 * (poses.volume_high - poses.volume_low);
  const auto turn = [&](double most_deg, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(unit(generator) * most_deg * M_PI / 180, axis);
  };
  // Grid x, y, z (towards the camera) along world x, z, −y.
  Eigen::Matrix3d facing;
  facing << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const Eigen::Matrix3d tilt =
      (turn(35, Eigen::Vector3d::UnitY()) * turn(35, Eigen::Vector3d::UnitX()) * turn(30, Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  Eigen::Vector3d place = Eigen::Vector3d(unit(generator), unit(generator), unit(generator)).cwiseProduct(reach);
  if (options.parallel_poses) place.y() = 0;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = options.parallel_poses ? facing : Eigen::Matrix3d(facing * tilt);
  pose.translation() = middle + place;
  return pose;
}

bool inside(const Eigen::Vector2d& pixel, const calib::ImageSize& size) {
  return pixel.x() > 0 && pixel.y() > 0 && pixel.x() < size.width_px - 1 && pixel.y() < size.height_px - 1;
}

// Passes the pixels of a share of the rows [first, end) around among each other.
void swap_labels(std::vector<calib::Correspondence>& rows, size_t first, double share, std::mt19937& generator) {
  std::vector<size_t> chosen;
  for (size_t i = first; i < rows.size(); ++i) chosen.push_back(i);
  std::shuffle(chosen.begin(), chosen.end(), generator);
  chosen.resize(static_cast<size_t>(std::lround(share * static_cast<double>(chosen.size()))));
  for (size_t i = 0; i + 1 < chosen.size(); ++i) {
    std::swap(rows[chosen[i]].camera, rows[chosen[i + 1]].camera);
    std::swap(rows[chosen[i]].projector, rows[chosen[i + 1]].projector);
  }
}

}  // namespace

geometry::Projection look_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target, const Eigen::Vector3d& up,
                             double focal_px, const calib::ImageSize& size, const std::array<double, 5>& distortion) {
  geometry::Projection projection =
      geometry::looking_at(position, target, {focal_px, focal_px},
                           {(size.width_px - 1) / 2.0, (size.height_px - 1) / 2.0}, size.width_px, size.height_px, up);
  projection.distortion = distortion;
  return projection;
}

geometry::Projection turned(const geometry::Projection& device, const Eigen::Vector3d& turn_deg) {
  const double angle_deg = turn_deg.norm();
  if (angle_deg == 0) return device;
  const geometry::Decomposition split = geometry::decompose(device);
  const Eigen::Matrix3d turn =
      split.intrinsics * Eigen::AngleAxisd(angle_deg * M_PI / 180, turn_deg / angle_deg).toRotationMatrix();
  geometry::Projection result = device;
  result.matrix.leftCols<3>() = turn * split.rotation_camera_from_world;
  result.matrix.col(3) = turn * split.translation_camera_from_world;
  return result;
}

SyntheticPoses make_synthetic_poses(const SyntheticOptions& options) {
  SyntheticPoses made;
  calib::Poses& poses = made.poses;
  poses.camera = {1280, 1024};
  poses.projector = {912, 1140};
  poses.tracker_noise_m = options.tracker_noise_m;
  poses.volume_low = Eigen::Vector3d(-0.25, -0.25, 0.75);
  poses.volume_high = Eigen::Vector3d(0.25, 0.25, 1.25);
  const Eigen::Vector3d target(0.01, 0, 1.02), up(0, 0, 1);
  made.camera = look_at({-0.3, -2.2, 1.1}, target, up, 1400, poses.camera, {-0.12, 0.08, 0.0004, -0.0003, 0});
  made.projector = look_at({0.45, -2.15, 1.25}, target, up, 1500, poses.projector, {-0.05, 0.02, 0, 0.0005, 0});

  std::mt19937 generator(options.seed);
  std::normal_distribution<double> normal(0, 1);
  const std::vector<Eigen::Vector3d> markers = calib::marker_positions(options.grid);
  for (int pose = 0; pose < options.poses; ++pose) {
    const Eigen::Isometry3d world_from_grid = draw_pose(options, poses, generator);
    made.world_from_grid.push_back(world_from_grid);
    const bool before_knock = pose < options.knocked_pose;
    const Eigen::Vector3d knock_deg(0, options.knocked_deg, 0);
    const auto camera = before_knock && !options.knocked_projector ? turned(made.camera, knock_deg) : made.camera;
    const auto projector =
        before_knock && options.knocked_projector ? turned(made.projector, knock_deg) : made.projector;
    const size_t first_row = poses.rows.size();
    for (int marker = 0; marker < options.grid.count(); ++marker) {
      const Eigen::Vector3d truth = world_from_grid * markers[marker];
      const Eigen::Vector3d seen = pose == options.moved_pose ? Eigen::Vector3d(truth + options.moved_m) : truth;
      const auto noise = [&](double sd) { return sd * normal(generator); };
      calib::Correspondence row;
      row.pose = pose;
      row.marker = marker;
      for (int axis = 0; axis < 3; ++axis) row.position[axis] = truth[axis] + noise(options.tracker_noise_m);
      const Eigen::Vector2d camera_pixel =
          geometry::project(camera, seen) +
          Eigen::Vector2d(noise(options.camera_noise_px), noise(options.camera_noise_px));
      const Eigen::Vector2d projector_pixel =
          geometry::project(projector, seen) +
          Eigen::Vector2d(noise(options.projector_noise_px), noise(options.projector_noise_px));
      if (inside(camera_pixel, poses.camera)) row.camera = camera_pixel;
      // What the camera does not see cannot be decoded.
      if (row.camera && inside(projector_pixel, poses.projector)) row.projector = projector_pixel;
      poses.rows.push_back(row);
    }
    if (options.swapped_share > 0) swap_labels(poses.rows, first_row, options.swapped_share, generator);
  }
  return made;
}

double volume_error_px(const geometry::Projection& solved, const geometry::Projection& truth,
                       const calib::Poses& poses) {
  double sum = 0;
  int count = 0;
  for (const Eigen::Vector3d& point : calib::volume_points(poses.volume_low, poses.volume_high)) {
    const Eigen::Vector2d expected = geometry::project(truth, point);
    if (geometry::depth(truth, point) <= 0 || !inside(expected, {truth.width_px, truth.height_px})) continue;
    sum += (geometry::project(solved, point) - expected).squaredNorm();
    ++count;
  }
  return count > 0 ? std::sqrt(sum / (2 * count)) : std::nan("");
}

}  // namespace selvedge::hardware_sim
