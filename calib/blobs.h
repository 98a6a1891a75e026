// Bright blobs in a dark image, as retro-reflective markers appear in the light beside the lens.
//
// Pixels above a threshold between the dark and the bright end of the image, grouped by 8-neighbourhood; the
// centre is the mean of pixels weighted by their grey over the local background, taken over the group and a
// rim of two pixels. Round blobs come out to about 0.03 px. Pixels, (0,0) at the centre of the top-left one.
// Source: M. R. Shortis et al., A comparison of some techniques for the subpixel location of discrete target
// images, 1994.
#pragma once

#include <vector>

#include "calib/grey_image.h"

namespace selvedge::calib {

struct Blob {
  Eigen::Vector2d centre;      // px
  double area_px = 0;          // above the threshold
  double elongation = 1;       // longer over shorter axis, from second moments
  double fill = 1;             // area over that of the ellipse with the same moments; 1 for an ellipse
  double saturated_share = 0;  // of the pixels above the threshold
  bool cut_off = false;        // touches the image border
};

struct BlobOptions {
  int least_area_px = 9;
  int most_area_px = 4000;
  double threshold_share = 0.4;  // of the way from the dark to the bright end
  double least_contrast = 25;    // grey levels between the two ends; less: no blobs
};

std::vector<Blob> find_blobs(const GreyImage& image, const BlobOptions& options = {});

// Shape of one round marker seen at a slant; false for merged pairs and broken ones.
bool looks_like_one_disc(const Blob& blob);

}  // namespace selvedge::calib
