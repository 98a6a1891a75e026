// Poses of a lab as images and the tracker's CSV, without a rig: one folder in, PoseImages out.
//
//   poses.json    as poses/1, and "images": {"markers": FILE, "sequence": [{"file": FILE, "kind": "off|solid|gray_code|
//                 phase_shift", "orientation": "horizontal|vertical", "bit", "inverted", "period_px", "first_px",
//                 "phase_rad", "level"}, …]}; a field that a kind does not use may be missing
//   tracker.csv   pose,marker,x,y,z: m
//   pose-N/FILE   8-bit grey images of the camera's size, one folder a pose
//
// Source: docs/calibration.md.
#pragma once

#include <filesystem>
#include <vector>

#include "calib/read_images.h"

namespace selvedge::calib {

struct ImageFolder {
  Poses header;  // no rows
  std::vector<PoseImages> poses;
};

// Throws BadInput naming file, line or key, what was found and what was expected.
ImageFolder read_image_folder(const std::filesystem::path& folder);

void write_image_folder(const ImageFolder& images, const std::filesystem::path& folder);

}  // namespace selvedge::calib
