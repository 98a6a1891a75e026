// The fold metric: how far the folds of a simulated frame are from those of a recorded one.
//
// Per frame, over pixels (i, j) (Bhat et al. 2003, section 4):
//   E_fold  = Σ M · (θ_recorded − θ_simulated)²        over the overlap of both silhouettes, θ wrapped mod π
//   E_silh  = Σ |A_recorded − A_simulated|
//   E       = E_fold + α E_silh,   α = 0.1
// θ is the angle map: the dominant orientation of the projected stripes; M = 1 where |∇θ_recorded| ≥ τ;
// A = 1 inside the silhouette. Angles in rad, gradients in rad/px, E in rad² · px.
//
// θ comes from the steerable quadrature pair G2/H2 (Freeman & Adelson 1991, Tables III to VI): seven separable
// basis filters, coefficients C2 and C3 of the local orientation energy (Appendix I), both blurred with a
// Gaussian, θ = ½ arg(C2, C3). θ is the direction across the stripes: 0 for vertical stripes, growing
// counter-clockwise as the picture is seen (rows downwards); range (−π/2, π/2].
// "Kernel size 12" is read as a support 12 px wide: 13 taps at −6 … 6 px, filter coordinate 0.67 · 2/3 = 0.447 a
// pixel, so the taps span ±2.68 as the nine taps of the 1991 tables do. Taps have their mean removed where
// the continuous filter has none (G2), so flat grey gives no answer. Frames are continued by their edge pixels.
#pragma once

#include <vector>

#include "render/stripe_pattern.h"

namespace selvedge::fit {

using render::Image;

struct FoldMetricOptions {
  int kernel_radius_px = 6;               // taps = 2 · radius + 1
  double tap_spacing = 0.67 * 4.0 / 6.0;  // filter coordinate a pixel
  double coefficient_blur_px = 2.0;       // one standard deviation of the Gaussian over C2, C3
  double mask_threshold_rad_px = 0.01;    // τ
  double silhouette_weight = 0.1;         // α
};

// Row major, width × height.
struct AngleMap {
  int width = 0, height = 0;
  std::vector<float> angle_rad;        // θ; 0 outside the silhouette
  std::vector<float> gradient_rad_px;  // |∇θ|, θ wrapped; 0 outside and at the silhouette's edge
  std::vector<unsigned char> inside;   // A
};

struct FoldError {
  double fold = 0;        // rad² px
  double silhouette = 0;  // px
  double total = 0;       // fold + α silhouette
  int overlap_px = 0;     // pixels inside both silhouettes
  int masked_px = 0;      // of these, with M = 1
};

// Holds the filter taps and the working rows; one instance a thread.
class FoldMetric {
 public:
  explicit FoldMetric(const FoldMetricOptions& options = {});

  // inside: 1 in the silhouette, row major, of the image's size. Orientation is computed in the silhouette's
  // bounding box alone.
  AngleMap angle_map(const render::Image& image, const std::vector<unsigned char>& inside);

  // The same without a silhouette: every pixel counts as inside.
  AngleMap angle_map(const render::Image& image);

  FoldError compare(const AngleMap& recorded, const AngleMap& simulated) const;

  const FoldMetricOptions& options() const { return options_; }

 private:
  struct Box {
    int left, top, right, bottom;
  };
  void orientation(const render::Image& image, Box box, AngleMap& map);

  FoldMetricOptions options_;
  std::vector<float> taps_;       // five filters, each from the centre tap outwards (the rest by symmetry)
  std::vector<float> blur_taps_;  // likewise
  std::vector<float> grey_, filtered_, coefficients_, blurred_;  // working rows
};

}  // namespace selvedge::fit
