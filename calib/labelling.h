// Which blob is which marker, from the tracker's positions alone.
//
// A camera is guessed, then made to agree with the blobs by nearest neighbours and refinement in turn
// (iterated closest point with a robust loss). The guess comes from whoever knows roughly where the camera
// stands, or from the poses themselves: over all directions of view the camera's place that best brings the
// mean of each pose's markers to the mean of its blobs is linear to find, and the best directions are tried.
// Poses that then have few partners are tried with the image shifted: the camera was knocked between poses.
// Hidden markers, merged and stray blobs stay without a partner. m, px.
// Source: P. Besl, N. McKay, A method for registration of 3-D shapes, 1992; docs/calibration.md.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "calib/blobs.h"
#include "calib/camera_model.h"

namespace selvedge::calib {

struct TrackedMarker {
  int marker = 0;
  Eigen::Vector3d position;  // m
};

// One pose: what the tracker says and what the image shows.
struct UnlabelledPose {
  int pose = 0;
  std::vector<TrackedMarker> markers;
  std::vector<Blob> blobs;
};

struct LabelledMarker {
  int pose = 0;
  int marker = 0;
  std::optional<Eigen::Vector2d> pixel;
  std::string why;  // without a pixel: hidden, merged
};

struct Labelling {
  bool found = false;                                  // false: no camera explains the blobs
  CameraParameters camera = CameraParameters::Zero();  // rough, good to a few pixels
  double matched_share = 0;                            // of the tracked markers
  std::vector<LabelledMarker> markers;
  int stray_blobs = 0;
};

struct LabellingOptions {
  std::optional<CameraParameters> camera;  // rough guess, from which 10° and 20 % are bridged
  double gate_px = 4;                      // of a final partner
  double tracker_noise_m = 0.0003;
};

Labelling label_markers(const std::vector<UnlabelledPose>& poses, const ImageSize& size,
                        const LabellingOptions& options);

}  // namespace selvedge::calib
