// What the projector shows in one image of a calibration sequence, and the sequence itself.
//
// x is the projector row where the bands are horizontal, the column where they are vertical:
//   gray_code:   bright where bit `bit` (0 = least significant) of x ⊕ (x >> 1) is set
//   phase_shift: ½ + ½ cos(2π (x − first_px) / period_px + phase_rad)
//   solid:       1 everywhere;  off: the lamp is dark
// `inverted` shows one minus that, and all is multiplied by `level`. The grey code finds the period, the
// phase the place within it. Source: J. Salvi et al., Pattern codification strategies in structured light
// systems, 2004, sections 2 and 4.
#pragma once

#include <vector>

#include "calib/poses.h"

namespace selvedge::calib {

struct PatternStep {
  enum class Kind { off, solid, gray_code, phase_shift };
  Kind kind = Kind::off;
  bool horizontal = true;  // bands run left to right and code the row
  int bit = 0;
  bool inverted = false;
  double period_px = 32;
  double first_px = 0;
  double phase_rad = 0;
  double level = 1;

  bool operator==(const PatternStep&) const = default;
};

struct SequenceOptions {
  double period_px = 32;  // of the phase shift
  int phases = 6;         // five or more also show the second harmonic
  double level = 1;       // of every bright pixel
};

// off, solid at five levels, then for either direction the grey code's bits that tell half periods apart,
// each with its inverse, and the phases.
std::vector<PatternStep> calibration_sequence(const ImageSize& projector, const SequenceOptions& options = {});

// off, white, and every bit of the grey code in either direction, each with its inverse: for projectors that
// cannot show greys.
std::vector<PatternStep> grey_code_sequence(const ImageSize& projector);

// off, white, and the grey code's bits from 4 px up in either direction, without inverses: a quick look.
std::vector<PatternStep> coarse_code_sequence(const ImageSize& projector);

// Brightness of the projector pixel that holds (column, row), 0 dark to 1 full, before any gamma.
double brightness(const PatternStep& step, double column_px, double row_px);

}  // namespace selvedge::calib
