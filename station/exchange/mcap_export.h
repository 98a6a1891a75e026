// A trial beside the motion that a fit's parameters give it, as an MCAP file for Foxglove and its like: JSON messages
// of Foxglove's types (github.com/foxglove/foxglove-sdk, schemas), in the frame "mocap" (m, z up).
//
//   /corners, /markers, /surface  foxglove.PointCloud     x, y, z (float32, m); of markers their number; hidden left
//   out /camera/image                 foxglove.CompressedImage    the trial's PNG files /camera/calibration, /tf
//   foxglove.CameraCalibration, FrameTransform     once: where the camera stands /arm/measured, /arm/commanded
//   foxglove.PoseInFrame    the tool's point /fabric/simulated             foxglove.SceneUpdate    the fabric as
//   triangles, if there is a fit
//
// Times are the trial's own. Where its first is below 0 all count from that; the file's metadata "selvedge" has it as
// first_s, with trial, fabric and the fit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "capture/trial/trial.h"
#include "station/motion_file.h"

namespace selvedge::station {

struct McapExported {
  uint64_t messages = 0;
  double duration_s = 0;
};

// Whole file or nothing. Throws BadInput where an image is missing, a time does not fit or the file can lie nowhere,
// std::runtime_error where the disk refuses.
McapExported export_mcap(const trial::Trial& trial, const std::optional<SimulatedMotion>& simulated,
                         const std::filesystem::path& file);

}  // namespace selvedge::station
