// Which projector pixel lights a camera pixel, from images of grey codes and phase shifts.
//
// With N phases φ_k the grey of a pixel is A + B g(½ + ½ cos(θ + φ_k)), g(p) = p^γ; its first harmonic gives
// θ = 2π (x − first) / period, the grey code says which period. γ is measured from the levels of a plain
// picture, or from the ratio ρ = (γ − 1)/(γ + 2) of the second harmonic to the first, and taken out before the phase.
// A sequence without phases is read from the grey code alone, to the middle of the finest interval whose bit the
// pixel still shows: projectors that hold binary patterns only (DLPC350) come out at about a pixel each, which a
// ring of hundreds of pixels averages.
// Pixels that clip, that are too dark to tell a bit, or whose code and phase disagree hold NaN.
// The ratio of the phases' contrast to that of plain white against dark gives the blur of the projector:
//   σ = period/(π√2) · √(−ln ratio).
// Projector pixels; grey levels. Source: J. Salvi et al., 2004; K. Liu et al., Gamma model and its analysis for
// phase measuring profilometry, 2010, equations 8 and 13.
#pragma once

#include <optional>
#include <vector>

#include "calib/grey_image.h"
#include "calib/pattern_step.h"

namespace selvedge::calib {

struct PatternImage {
  PatternStep step;
  GreyImage image;
};

struct DecodeOptions {
  int saturated_grey = 252;          // this and above is clipped
  double least_contrast_grey = 12;   // white over dark
  double least_modulation_grey = 5;  // amplitude of the phases
  std::optional<double> gamma;       // known; otherwise measured
};

// Where pixels were lost, as shares of those looked at.
struct DecodeLosses {
  double clipped = 0, dark = 0, ambiguous = 0;
};

struct Decoded {
  std::vector<Eigen::Vector2d> column_row;  // one a pixel asked for; NaN where it could not be told
  std::vector<double> amplitude;            // of the phases, grey levels
  DecodeLosses losses;
  double gamma = 1;
  bool gamma_measured = false;
  double blur_px = 0;  // of the projector, median
};

// pixels: (column, row) of the camera pixels to decode. Throws BadInput where the sequence lacks what a
// direction needs: grey-code bits down to half the phases' period, or down to bit 3 without phases.
Decoded decode(const std::vector<PatternImage>& sequence, const std::vector<Eigen::Vector2i>& pixels,
               const DecodeOptions& options = {});

}  // namespace selvedge::calib
