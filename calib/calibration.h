// Calibration of camera and projector from grid markers in several poses, with a verdict on how far to
// trust it.
//
//   sightings of camera and projector → each device solved → what both saw alike is put down to the board →
//   predicted deviation where the fabric moves → verdict and advice
//
// Source: docs/calibration.md.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/device_solver.h"
#include "calib/poses.h"
#include "calib/predicted_deviation.h"

namespace selvedge::calib {

struct Options {
  DeviceOptions device;
  // Predicted deviation per axis at the fabric, px.
  double good_camera_sd_px = 0.15;
  double good_projector_sd_px = 0.25;
  double refused_sd_px = 1.0;        // either device
  double good_left_out_ratio = 1.5;  // leave-one-pose-out over training residual
  double many_rejected_share = 0.4;  // of the sightings: more make the calibration doubtful
};

enum class Verdict { good, doubtful, refused };
const char* to_text(Verdict verdict);

struct DeviceCalibration {
  DeviceSolution solution;
  VolumeDeviation deviation;

  // Zero matrix where not solved.
  geometry::Projection projection() const;
};

struct Calibration {
  Poses inputs;
  Options options;
  DeviceCalibration camera;
  std::optional<DeviceCalibration> projector;  // absent where no row has a projector pixel
  double triangulation_sd_mm = 0;              // NaN where it cannot be said
  std::vector<RejectedSighting> rejected;      // of both devices, one a row of the input
  Verdict verdict = Verdict::refused;
  std::string advice;  // sentences
};

// Throws BadInput where no row has a camera pixel. Everything else ends in a verdict.
Calibration calibrate(const Poses& poses, const Options& options = {});

// Sightings of one device.
std::vector<Sighting> camera_sightings(const Poses& poses);
std::vector<Sighting> projector_sightings(const Poses& poses);

}  // namespace selvedge::calib
