// read_calibration and read_inputs: the "calibration/1" file.
#include <cmath>

#include "calib/calibration_file.h"
#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::calib {

namespace {

using nlohmann::json;

const json& member(const json& object, const std::string& key, const std::string& where) {
  if (!object.is_object() || !object.contains(key)) refuse(where, "key \"{}\" is missing", key);
  return object.at(key);
}

double number(const json& value, const std::string& where) {
  if (!value.is_number()) refuse(where, "expected a number, found {}", value.dump());
  return value.get<double>();
}

std::string text(const json& value, const std::string& where) {
  if (!value.is_string()) refuse(where, "expected a text, found {}", value.dump());
  return value.get<std::string>();
}

int pixels(const json& value, const std::string& where) {
  const double found = number(value, where);
  if (!(found >= 0 && found <= 100000) || found != std::floor(found))
    refuse(where, "expected a whole number of pixels from 0 to 100000, found {}", found);
  return static_cast<int>(found);
}

geometry::Projection projection_from_json(const json& device, const std::string& where) {
  geometry::Projection projection;
  const json& rows = member(device, "projection", where);
  const std::string key = where + ".projection";
  if (!rows.is_array() || rows.size() != 3) refuse(key, "expected three rows of four numbers, found {}", rows.dump());
  for (int i = 0; i < 3; ++i) {
    if (!rows[i].is_array() || rows[i].size() != 4) refuse(key, "expected three rows of four numbers");
    for (int j = 0; j < 4; ++j) projection.matrix(i, j) = number(rows[i][j], key);
  }
  const Eigen::Vector3d values = geometry::singular_values(projection.matrix);
  if (values[2] < 1e-9 * values[0]) refuse(key, "expected a matrix of rank 3, found one below");
  const json& distortion = member(device, "distortion", where);
  if (!distortion.is_array() || distortion.size() != 5)
    refuse(where + ".distortion", "expected k1 k2 p1 p2 k3, found {}", distortion.dump());
  for (int i = 0; i < 5; ++i) projection.distortion[i] = number(distortion[i], where + ".distortion");
  if (device.contains("width_px")) projection.width_px = pixels(device["width_px"], where + ".width_px");
  if (device.contains("height_px")) projection.height_px = pixels(device["height_px"], where + ".height_px");
  return projection;
}

json read_file(const std::filesystem::path& path) {
  json value = files::read_json(path);
  const json& format = member(value, "format", path.string());
  if (format != "calibration/1") refuse(path.string(), "expected format \"calibration/1\", found {}", format.dump());
  return value;
}

double number_or_nan(const json& device, const char* key) {
  return device.contains(key) && device[key].is_number() ? device[key].get<double>() : std::nan("");
}

}  // namespace

Poses read_inputs(const std::filesystem::path& path) {
  return poses_from_json(member(read_file(path), "inputs", path.string()), path.string() + ": inputs");
}

StoredCalibration read_calibration(const std::filesystem::path& path) {
  const json value = read_file(path);
  const std::string where = path.string();
  StoredCalibration stored;
  stored.verdict = text(member(value, "verdict", where), where + ": verdict");
  if (stored.verdict == "refused")
    refuse(where, "this calibration was refused and holds no matrices: {}",
           value.contains("advice") ? text(value["advice"], where + ": advice") : "no advice given");
  const json& camera = member(value, "camera", where);
  stored.camera = projection_from_json(camera, where + ": camera");
  stored.camera_rms_px = number_or_nan(camera, "rms_px");
  stored.camera_sd_px = number_or_nan(camera, "predicted_sd_px");
  if (const json& projector = member(value, "projector", where); !projector.is_null()) {
    stored.projector = projection_from_json(projector, where + ": projector");
    stored.projector_rms_px = number_or_nan(projector, "rms_px");
    stored.projector_sd_px = number_or_nan(projector, "predicted_sd_px");
  }
  if (value.contains("inputs")) stored.inputs = poses_from_json(value["inputs"], where + ": inputs");
  return stored;
}

}  // namespace selvedge::calib
