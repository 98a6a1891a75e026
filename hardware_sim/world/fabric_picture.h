// What the simulated camera sees of the fabric, fast enough for a live stream: the scanline map of render/, four
// samples a pixel at the outline, shadows by a second map from the projector, camera blur.
//
//   grey = background, or ambient + (lit − ambient) · |n·l| · brightness(projector pixel) · visible
//
// Brightness comes blurred by the projector's own spread. No motion blur: exposures are short.
// Units: grey levels before noise, px, m.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "geometry/projection.h"
#include "render/row_map.h"
#include "rig/projector/pattern.h"

namespace selvedge::hardware_sim {

struct PictureOptions {
  double background_grey = 4;
  double ambient_grey = 14;
  double lit_grey = 215;
  double projector_blur_px = 1.0;  // projector px, one standard deviation
  double camera_blur_px = 0.5;     // camera px
  double shadow_bias_m = 0.004;
};

class FabricPicture {
 public:
  FabricPicture(const geometry::Projection& camera, const geometry::Projection& projector,
                const PictureOptions& options);

  // Grey levels, row major, not rounded and without noise.
  const std::vector<float>& take(const Eigen::Matrix3Xd& position, const std::vector<std::array<int, 3>>& triangles,
                                 const projector::Pattern& pattern);

 private:
  void set_pattern(const projector::Pattern& pattern);
  float shown(float column_px, float row_px) const;
  float fabric_grey(float column_px, float row_px, float projector_depth_m, float facing) const;
  void blur();

  geometry::Projection camera_, projector_;
  PictureOptions options_;
  Eigen::Vector3d eye_, lamp_;
  render::RowMap map_, fine_, from_projector_;
  projector::Pattern pattern_;
  bool horizontal_ = true;
  std::vector<float> profile_;  // kPerMirror values a mirror, blurred
  std::vector<float> row_, column_, depth_, light_depth_, facing_, shadow_row_, shadow_column_, shadow_depth_;
  std::vector<float> grey_, blurred_;
};

// Brightness of each mirror along the pattern's axis, `per_mirror` values a mirror, convolved with a Gaussian.
std::vector<float> blurred_profile(const projector::Pattern& pattern, int mirrors, int per_mirror, double blur_px);

}  // namespace selvedge::hardware_sim
