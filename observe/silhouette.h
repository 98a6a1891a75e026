// Silhouette of a fabric in front of a dark background: mask, and sub-pixel points of its outline.
//
// Inside is what stands out of the background by five times its noise, holes filled, largest piece; border
// pixels darker than half the level 2.5 px further in are taken off again, since the lens spreads bright stripes
// outwards. Outline points lie where grey along the normal crosses half-way between the background and the
// level 2 to 3 px inside; points at corners of the outline and where the inside is not level are left out.
// Units: px, grey levels.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "render/stripe_pattern.h"

namespace selvedge::observe {

using render::Image;

struct SilhouettePoint {
  Eigen::Vector2d pixel;   // of the recorded image
  Eigen::Vector2d normal;  // unit, outwards, in the image
  double sd_px = 0;        // along the normal
};

struct Background {
  double grey = 0;
  double noise_grey = 0;  // one standard deviation
};

// Median and spread of the frame's outermost 8 pixels.
Background measure_background(const Image& image);

// 1 inside, 0 outside, row major.
std::vector<unsigned char> silhouette_mask(const Image& image, const Background& background);

std::vector<SilhouettePoint> outline_points(const Image& image, const std::vector<unsigned char>& inside,
                                            const Background& background);

// Those beside which stripes do not run along the outline. Where they do, the border between fabric that is lit and
// fabric that is not looks like the edge of the fabric, which hangs on into the dark: by millimetres, in all pictures.
// period_px: of the stripes in the image, about.
std::vector<SilhouettePoint> where_stripes_cross(const Image& image, const std::vector<unsigned char>& inside,
                                                 const Background& background, double period_px,
                                                 const std::vector<SilhouettePoint>& points);

}  // namespace selvedge::observe
