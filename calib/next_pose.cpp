#include "calib/next_pose.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <fmt/format.h>

namespace selvedge::calib {

namespace {

using Covariance = Eigen::Matrix<double, kParameters, kParameters>;

struct Tilt {
  Eigen::Matrix3d turn;
  const char* words;
};

std::vector<Tilt> tilts() {
  const auto about = [](double degrees, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(degrees * M_PI / 180, axis).toRotationMatrix();
  };
  return {{Eigen::Matrix3d::Identity(), "held the same way"},
          {about(30, Eigen::Vector3d::UnitZ()), "turned 30 degrees to the left about the vertical"},
          {about(-30, Eigen::Vector3d::UnitZ()), "turned 30 degrees to the right about the vertical"},
          {about(30, Eigen::Vector3d::UnitX()), "tipped 30 degrees about the x axis"},
          {about(-30, Eigen::Vector3d::UnitX()), "tipped -30 degrees about the x axis"},
          {about(90, Eigen::Vector3d::UnitY()), "rolled by 90 degrees about the y axis"}};
}

// Positions of the pose with the most markers, from their mean.
std::pair<int, std::vector<Eigen::Vector3d>> fullest_pose(const Poses& poses) {
  std::map<int, std::vector<Eigen::Vector3d>> by_pose;
  for (const Correspondence& row : poses.rows) by_pose[row.pose].push_back(row.position);
  auto fullest = std::max_element(by_pose.begin(), by_pose.end(),
                                  [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : fullest->second) mean += p / static_cast<double>(fullest->second.size());
  for (auto& p : fullest->second) p -= mean;
  return {fullest->first, fullest->second};
}

Covariance with_pose(const DeviceCalibration& device, const std::vector<Eigen::Vector3d>& markers, int& seen) {
  const DeviceSolution& d = device.solution;
  std::vector<Eigen::Vector3d> in_sight;
  for (const Eigen::Vector3d& marker : markers)
    if (in_view(d.refined.camera, d.size, marker)) in_sight.push_back(marker);
  seen = static_cast<int>(in_sight.size());
  if (in_sight.empty()) return d.uncertainty.covariance;
  const auto rows = static_cast<Eigen::Index>(2 * in_sight.size());
  Eigen::MatrixXd jacobian(rows, kParameters), noise = Eigen::MatrixXd::Zero(rows, rows);
  for (size_t i = 0; i < in_sight.size(); ++i) {
    const PixelDerivatives at = derivatives(d.refined.camera, in_sight[i]);
    const auto row = static_cast<Eigen::Index>(2 * i);
    jacobian.middleRows<2>(row) = at.by_camera;
    noise.block<2, 2>(row, row) = sighting_covariance(at, d.refined.pixel_sd_px, d.input.tracker_noise_m);
  }
  const Covariance& c = d.uncertainty.covariance;
  const Eigen::MatrixXd spread = jacobian * c;
  return c - spread.transpose() * (noise + spread * jacobian.transpose()).ldlt().solve(spread);
}

}  // namespace

std::optional<NextPose> suggest_next_pose(const Calibration& calibration) {
  if (!calibration.camera.solution.solved || (calibration.projector && !calibration.projector->solution.solved))
    return std::nullopt;
  const auto [like_pose, shape] = fullest_pose(calibration.inputs);
  const Eigen::Vector3d low = calibration.inputs.volume_low, high = calibration.inputs.volume_high;
  const std::vector<Eigen::Vector3d> places = volume_points(low + 0.15 * (high - low), high - 0.15 * (high - low), 3);
  const std::vector<Eigen::Vector3d> judged_at = volume_points(low, high, 3);
  const int least_seen = static_cast<int>(shape.size()) / 2;
  std::optional<NextPose> best;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& place : places)
    for (const Tilt& tilt : tilts()) {
      NextPose candidate{{}, place, tilt.words, like_pose, 0, 0};
      for (const Eigen::Vector3d& p : shape) candidate.markers.push_back(place + tilt.turn * p);
      double cost = 0;
      bool seen_enough = true;
      const auto add = [&](const DeviceCalibration& device, double good_sd_px) {
        int seen = 0;
        const Covariance covariance = with_pose(device, candidate.markers, seen);
        seen_enough &= seen >= least_seen;
        cost +=
            volume_deviation(device.solution.refined.camera, covariance, device.solution.size, judged_at).mean_sd_px /
            good_sd_px;
      };
      add(calibration.camera, calibration.options.good_camera_sd_px);
      if (calibration.projector) add(*calibration.projector, calibration.options.good_projector_sd_px);
      if (!seen_enough || !(cost < least)) continue;
      least = cost;
      best = candidate;
    }
  if (!best) return best;
  // For the telling figure the same points as the calibration's own.
  const std::vector<Eigen::Vector3d> told_at = volume_points(low, high);
  const auto deviation_with = [&](const DeviceCalibration& device) {
    int seen = 0;
    const Covariance covariance = with_pose(device, best->markers, seen);
    return volume_deviation(device.solution.refined.camera, covariance, device.solution.size, told_at).mean_sd_px;
  };
  best->camera_sd_px = deviation_with(calibration.camera);
  if (calibration.projector) best->projector_sd_px = deviation_with(*calibration.projector);
  return best;
}

std::string to_text(const NextPose& next) {
  std::string text = fmt::format(
      "The next pose that would help most: the grid's middle at ({:.2f}, {:.2f}, {:.2f}) m, {} as in pose {}. Expected "
      "error at the fabric then: camera {:.3f} px",
      next.centre.x(), next.centre.y(), next.centre.z(), next.tilt, next.like_pose, next.camera_sd_px);
  if (next.projector_sd_px > 0) text += fmt::format(", projector {:.3f} px", next.projector_sd_px);
  return text + ".";
}

}  // namespace selvedge::calib
