// calibration.json: the result in the fixed keys of calibration/1, with its inputs, so that anyone can solve
// it again. A refused one holds null for every projection and distortion, so that nobody takes them up. Source of names
// and units: docs/calibration.md.
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "calib/calibration.h"

namespace selvedge::calib {

nlohmann::json to_json(const Calibration& calibration);

// Whole file or nothing.
void write_calibration(const Calibration& calibration, const std::filesystem::path& path);

// What others need of a calibration on disk.
struct StoredCalibration {
  geometry::Projection camera;
  std::optional<geometry::Projection> projector;
  double camera_rms_px = 0, projector_rms_px = 0;
  double camera_sd_px = 0, projector_sd_px = 0;  // predicted, per axis at the fabric
  std::string verdict;
  std::optional<Poses> inputs;
};

// Throws BadInput naming file, key, what was found and what was expected, and where the verdict is "refused".
StoredCalibration read_calibration(const std::filesystem::path& path);

// The poses that a calibration on disk was solved from, refused or not. Throws BadInput as read_calibration.
Poses read_inputs(const std::filesystem::path& path);

}  // namespace selvedge::calib
