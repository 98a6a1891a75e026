// The grey image that a camera takes of a fabric under projected stripes; off screen, through OSMesa.
//
// Per pixel: grey = ambient + (lit − ambient) · stripes(row) · |n·l| · visible, where n is the smoothed normal, l the
// direction to the projector; 0 light where projector and camera are on opposite sides of the fabric. `visible` comes
// from a shadow map: where the fabric hides the projector from itself. stripes(row) is the mirrors' brightness
// convolved with a Gaussian, the projector's blur, and averaged over the camera pixel's footprint (a mip map), so
// stripes neither alias nor crawl; outlines have four samples a pixel. Lens distortion is applied to the vertices. The
// fabric reflects alike everywhere. One GL context an instance; an instance may be used from any one thread at a time.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "geometry/projection.h"
#include "render/stripe_pattern.h"

namespace selvedge::render {

struct RenderOptions {
  double background_grey = 4;      // grey levels
  double ambient_grey = 16;        // fabric where no projector light falls
  double lit_grey = 220;           // fabric facing the projector in a bright stripe
  double projector_blur_px = 1.0;  // projector px, one standard deviation
  double camera_blur_px = 0.0;     // camera px, one standard deviation
  double shadow_bias_m = 0.004;    // nearer than this to what the projector sees counts as lit
};

class StripeRenderer {
 public:
  // Throws std::runtime_error where OSMesa gives no core 3.3 context.
  StripeRenderer(const geometry::Projection& camera, const geometry::Projection& projector,
                 const RenderOptions& options = {});
  ~StripeRenderer();
  StripeRenderer(StripeRenderer&&) noexcept;
  StripeRenderer& operator=(StripeRenderer&&) noexcept;

  // Until a pattern is set, the projector shows white.
  void set_pattern(const StripePattern& pattern);

  // Any picture that is constant along rows (horizontal) or columns: brightness of each row's or column's
  // mirrors, 0 to 1, as many as the projector has.
  void set_profile(bool horizontal, const std::vector<float>& brightness);

  // position: 3×N, m.
  Image render(const Eigen::Matrix3Xd& position, const std::vector<std::array<int, 3>>& triangles);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Area-weighted normals of the vertices, 3×N.
Eigen::Matrix3Xd vertex_normals(const Eigen::Matrix3Xd& position, const std::vector<std::array<int, 3>>& triangles);

}  // namespace selvedge::render
