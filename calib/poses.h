// Grid markers in several poses, as the tracker, the camera and the projector saw them: what a calibration
// is solved from, and the format poses/1 in which it lies on disk.
//
// Positions in m in the frame of the motion capture, z up. Pixels: (0,0) is the centre of the top-left one.
// Source of names and units: docs/calibration.md.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

namespace selvedge::calib {

// One marker in one pose; a device that did not see it holds nothing.
struct Correspondence {
  int pose = 0;
  int marker = 0;
  Eigen::Vector3d position;                          // tracker, m
  std::optional<Eigen::Vector2d> camera, projector;  // px, distorted as seen
};

struct ImageSize {
  int width_px = 0;
  int height_px = 0;
};

struct Poses {
  ImageSize camera, projector;
  double tracker_noise_m = 0;               // one standard deviation per axis
  Eigen::Vector3d volume_low, volume_high;  // where the fabric moves
  std::vector<Correspondence> rows;
};

// Reads poses.json and correspondences.csv. Throws BadInput naming file, line or key, what was found and
// what was expected.
Poses read_poses(const std::filesystem::path& folder);

// poses.json alone; no rows.
Poses read_poses_header(const std::filesystem::path& path);

// Writes both files, each whole or not at all.
void write_poses(const Poses& poses, const std::filesystem::path& folder);

// What poses.json holds.
nlohmann::json header_to_json(const Poses& poses);

// The same content as one JSON value, rows as arrays in the column order of correspondences.csv.
nlohmann::json to_json(const Poses& poses);
// where: the file and key for the refusals.
Poses poses_from_json(const nlohmann::json& value, const std::string& where);

}  // namespace selvedge::calib
