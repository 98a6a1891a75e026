#include "calib/calibration_file.h"

#include "calib/verdict.h"
#include "files/bad_input.h"
#include "files/json_number.h"
#include "files/whole_file.h"

namespace selvedge::calib {

namespace {

using nlohmann::json;

json by_name(const std::map<int, double>& values) {
  json object = json::object();
  for (const auto& [name, value] : values) object[std::to_string(name)] = files::finite_or_null(value);
  return object;
}

// What happened between or in the poses: a knock with the poses on both sides of it, or a pose left out.
json event_json(const DeviceSolution& d, const PoseEvent& event, const std::vector<Eigen::Vector3d>& volume) {
  json value = {{"kind", event.knocked ? "device_moved_before_pose" : "pose_does_not_fit"},
                {"pose", event.pose},
                {"turned_deg", event.shift.head<3>().norm() * 180 / M_PI}};
  if (event.knocked) {
    value["last_pose_before"] = pose_before(d, event.pose);
    value["moved_mm"] = device_displacement(d.refined.camera, event.shift).distance_mm;
    value["moved_px_at_fabric"] = shift_at_fabric_px(d.refined.camera, event.shift, volume);
  }
  return value;
}

json matrix_json(const Eigen::MatrixXd& matrix) {
  json rows = json::array();
  for (int i = 0; i < matrix.rows(); ++i) {
    json row = json::array();
    for (int j = 0; j < matrix.cols(); ++j) row.push_back(matrix(i, j));
    rows.push_back(row);
  }
  return rows;
}

json device_json(const DeviceCalibration& device, const Calibration& calibration) {
  const DeviceSolution& d = device.solution;
  const bool trusted = calibration.verdict != Verdict::refused;
  if (!d.solved)
    return {{"projection", nullptr},       {"distortion", nullptr},
            {"rms_px", nullptr},           {"leave_one_pose_out_px", nullptr},
            {"predicted_sd_px", nullptr},  {"worst_pose", nullptr},
            {"width_px", d.size.width_px}, {"height_px", d.size.height_px}};
  json events = json::array();
  const auto volume = volume_points(calibration.inputs.volume_low, calibration.inputs.volume_high, 3);
  for (const PoseEvent& event : d.events) events.push_back(event_json(d, event, volume));
  const geometry::Projection projection = device.projection();
  return {{"projection", trusted ? matrix_json(projection.matrix) : json(nullptr)},
          {"distortion", trusted ? json(projection.distortion) : json(nullptr)},
          {"rms_px", d.rms_px},
          {"leave_one_pose_out_px", files::finite_or_null(d.leave_one_pose_out_px)},
          {"predicted_sd_px", files::finite_or_null(device.deviation.mean_sd_px)},
          {"worst_pose", d.worst_pose},
          {"width_px", d.size.width_px},
          {"height_px", d.size.height_px},
          {"worst_marker", d.worst_marker},
          {"predicted_sd_uv_px",
           {files::finite_or_null(device.deviation.mean_sd_uv_px.x()),
            files::finite_or_null(device.deviation.mean_sd_uv_px.y())}},
          {"largest_sd_px", files::finite_or_null(device.deviation.largest_sd_px)},
          {"share_of_volume_in_view", device.deviation.share_in_view},
          {"pixel_noise_px", d.refined.pixel_sd_px},
          {"singular_value_ratio", d.singular_ratio},
          {"pose_rms_px", by_name(d.pose_rms_px)},
          {"left_out_pose_rms_px", by_name(d.left_out_rms_px)},
          {"marker_rms_px", by_name(d.marker_rms_px)},
          {"events", events},
          {"parameters",
           {{"order", "fx fy cx cy k1 k2 p1 p2 k3 rx ry rz tx ty tz"},
            {"value", std::vector<double>(d.refined.camera.begin(), d.refined.camera.end())},
            {"covariance", matrix_json(d.uncertainty.covariance)}}}};
}

}  // namespace

json to_json(const Calibration& calibration) {
  json rejected = json::array();
  for (const RejectedSighting& r : calibration.rejected)
    rejected.push_back({{"pose", r.pose}, {"marker", r.marker}, {"why", r.why}});
  const DeviceOptions& device = calibration.options.device;
  return {{"format", "calibration/1"},
          {"camera", device_json(calibration.camera, calibration)},
          {"projector", calibration.projector ? device_json(*calibration.projector, calibration) : json(nullptr)},
          {"triangulation_sd_mm", files::finite_or_null(calibration.triangulation_sd_mm)},
          {"rejected", rejected},
          {"verdict", to_text(calibration.verdict)},
          {"advice", calibration.advice},
          {"options",
           {{"ransac_threshold_px", device.ransac.threshold_px},
            {"ransac_seed", device.ransac.seed},
            {"gate_sd", device.gate_sd},
            {"choose_distortion", device.choose_distortion},
            {"good_camera_sd_px", calibration.options.good_camera_sd_px},
            {"good_projector_sd_px", calibration.options.good_projector_sd_px},
            {"refused_sd_px", calibration.options.refused_sd_px}}},
          {"inputs", to_json(calibration.inputs)}};
}

void write_calibration(const Calibration& calibration, const std::filesystem::path& path) {
  files::write_json(path, to_json(calibration));
}

}  // namespace selvedge::calib
