#include "calib/calibration.h"

#include <cmath>
#include <map>

#include "calib/verdict.h"
#include "files/bad_input.h"

namespace selvedge::calib {

namespace {

std::vector<Sighting> sightings_of(const Poses& poses, std::optional<Eigen::Vector2d> Correspondence::*device) {
  std::vector<Sighting> sightings;
  for (size_t i = 0; i < poses.rows.size(); ++i) {
    const Correspondence& row = poses.rows[i];
    if (row.*device) sightings.push_back({row.pose, row.marker, static_cast<int>(i), row.position, *(row.*device)});
  }
  return sightings;
}

DeviceCalibration calibrate_device(const std::string& name, const Poses& poses, const ImageSize& size,
                                   const Options& options) {
  DeviceCalibration device;
  device.solution = solve_device(name, name == "camera" ? camera_sightings(poses) : projector_sightings(poses), size,
                                 poses.tracker_noise_m, options.device);
  if (device.solution.solved)
    device.deviation = volume_deviation(device.solution.refined.camera, device.solution.uncertainty.covariance, size,
                                        volume_points(poses.volume_low, poses.volume_high));
  return device;
}

std::vector<RejectedSighting> merge_rejected(const Calibration& calibration) {
  std::map<std::pair<int, int>, std::string> why;
  const auto add = [&](const std::vector<RejectedSighting>& rejected) {
    for (const RejectedSighting& r : rejected) {
      std::string& text = why[{r.pose, r.marker}];
      text += (text.empty() ? "" : "; ") + r.why;
    }
  };
  add(calibration.camera.solution.rejected);
  if (calibration.projector) add(calibration.projector->solution.rejected);
  std::vector<RejectedSighting> merged;
  for (const auto& [place, text] : why) merged.push_back({place.first, place.second, text});
  return merged;
}

}  // namespace

const char* to_text(Verdict verdict) {
  switch (verdict) {
    case Verdict::good: return "good";
    case Verdict::doubtful: return "doubtful";
    case Verdict::refused: return "refused";
  }
  return "";
}

geometry::Projection DeviceCalibration::projection() const {
  if (solution.solved) return to_projection(solution.refined.camera, solution.size);
  geometry::Projection none;
  none.width_px = solution.size.width_px;
  none.height_px = solution.size.height_px;
  return none;
}

std::vector<Sighting> camera_sightings(const Poses& poses) { return sightings_of(poses, &Correspondence::camera); }

std::vector<Sighting> projector_sightings(const Poses& poses) {
  return sightings_of(poses, &Correspondence::projector);
}

Calibration calibrate(const Poses& poses, const Options& options) {
  Calibration calibration;
  calibration.inputs = poses;
  calibration.options = options;
  calibration.triangulation_sd_mm = std::numeric_limits<double>::quiet_NaN();
  if (camera_sightings(poses).empty())
    refuse("correspondences", "expected at least one row with camera_u and camera_v, found none in {} rows",
           poses.rows.size());
  calibration.camera = calibrate_device("camera", poses, poses.camera, options);
  if (!projector_sightings(poses).empty())
    calibration.projector = calibrate_device("projector", poses, poses.projector, options);
  if (calibration.projector && calibration.camera.solution.solved && calibration.projector->solution.solved)
    calibration.triangulation_sd_mm = triangulation_sd_mm(calibration.camera.solution, calibration.projector->solution,
                                                          volume_points(poses.volume_low, poses.volume_high));
  calibration.rejected = merge_rejected(calibration);
  judge(calibration);
  return calibration;
}

}  // namespace selvedge::calib
