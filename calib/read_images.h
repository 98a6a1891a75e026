// From images to correspondences: markers found and labelled in the camera's image, and the projector pixel
// at each marker from the pattern images.
//
// The disc itself throws light back to the lens, so the projector is decoded on the white ring around it: a
// homography from camera to projector pixels, fitted robustly to the ring, carries the disc's centre over.
// m, px. Source: docs/calibration.md.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/calibration.h"
#include "calib/labelling.h"
#include "calib/structured_light.h"

namespace selvedge::calib {

// What was recorded while the grid stood still once.
struct PoseImages {
  int pose = 0;
  std::vector<TrackedMarker> markers;  // tracker's, those that it saw
  GreyImage marker_image;              // light beside the lens on, lamp off
  std::vector<PatternImage> sequence;  // light beside the lens off; empty: no projector in this pose
};

struct ReadingOptions {
  LabellingOptions labelling;
  BlobOptions blobs;
  DecodeOptions decode;
  // Ring about a disc in which the projector is decoded, as multiples of the disc's radius in the image.
  double ring_inner = 1.25, ring_outer = 2.5;
  int least_ring_pixels = 40;
};

struct ImageReading {
  Poses poses;                           // header filled from the caller's, rows from the images
  std::vector<RejectedSighting> unread;  // markers that a device gave no pixel for, and why
  std::vector<std::string> remarks;      // sentences for the advice: out of focus, clipped, gamma
  CameraParameters rough_camera = CameraParameters::Zero();
  double matched_share = 0;
  double gamma = 1;
  double projector_blur_px = 0;
  DecodeLosses losses;  // mean over markers
};

// header: sizes, tracker noise and fabric volume; its rows are ignored. Throws BadInput where an image has
// another size than the camera's, a sequence is incomplete, or no camera explains the blobs.
ImageReading read_images(const std::vector<PoseImages>& poses, const Poses& header, const ReadingOptions& options = {});

// calibrate() on the reading, with its remarks and what it could not read in the result.
Calibration calibrate_images(const std::vector<PoseImages>& poses, const Poses& header,
                             const ReadingOptions& reading = {}, const Options& options = {});

}  // namespace selvedge::calib
