// What a projector shows, and how bright it is at a projector pixel.
//
// x is the row where `orientation` is horizontal (bands run left to right), the column where it is vertical.
// Mirrors are square pixels, so x is first rounded to the nearest integer; pixel 0 is the centre of the
// first row or column.
//   stripes:     bright where (x − first_bright_row_px) mod period_px < duty · period_px
//   gray_code:   bright where bit `bit` (0 = least significant) of x ⊕ (x >> 1) is set
//   phase_shift: ½ + ½ cos(2π (x − first_bright_row_px) / period_px + phase_rad)
//   solid:       1 everywhere;  off: the lamp is dark
// `inverted` shows one minus that (not for off), and all is multiplied by `level`. Source of the stripe rule:
// docs/formats.md.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace selvedge::projector {

enum class PatternKind { off, solid, stripes, gray_code, phase_shift };
enum class Orientation { horizontal, vertical };

struct Pattern {
  PatternKind kind = PatternKind::off;
  Orientation orientation = Orientation::horizontal;
  double level = 1;                // brightness of bright pixels, 0 to 1 of full drive
  double period_px = 1;            // stripes, phase_shift; above 0
  double duty = 0.5;               // stripes: bright part of a period, 0 to 1
  double first_bright_row_px = 0;  // stripes, phase_shift; a column where orientation is vertical
  int bit = 0;                     // gray_code
  double phase_rad = 0;            // phase_shift
  bool inverted = false;

  bool operator==(const Pattern&) const = default;
};

// The same picture with the fields that its kind does not use at their defaults, so that == compares pictures.
inline Pattern canonical(const Pattern& pattern) {
  Pattern result{.kind = pattern.kind};
  if (pattern.kind == PatternKind::off) return result;
  result.level = pattern.level;
  result.inverted = pattern.inverted;
  if (pattern.kind == PatternKind::solid) return result;
  result.orientation = pattern.orientation;
  if (pattern.kind == PatternKind::gray_code) {
    result.bit = pattern.bit;
    return result;
  }
  result.period_px = pattern.period_px;
  result.first_bright_row_px = pattern.first_bright_row_px;
  if (pattern.kind == PatternKind::stripes) result.duty = pattern.duty;
  if (pattern.kind == PatternKind::phase_shift) result.phase_rad = pattern.phase_rad;
  return result;
}

// Brightness of the mirror that holds (column_px, row_px), 0 dark to 1 full.
inline double brightness(const Pattern& pattern, double column_px, double row_px) {
  const double x = std::floor((pattern.orientation == Orientation::horizontal ? row_px : column_px) + 0.5);
  double value = 0;
  switch (pattern.kind) {
    case PatternKind::off: return 0;
    case PatternKind::solid: value = 1; break;
    case PatternKind::stripes: {
      const double from_first = x - pattern.first_bright_row_px;
      const double in_period = from_first - pattern.period_px * std::floor(from_first / pattern.period_px);
      value = in_period < pattern.duty * pattern.period_px ? 1 : 0;
      break;
    }
    case PatternKind::gray_code: {
      const auto index = static_cast<std::uint32_t>(x < 0 ? 0 : x);
      value = ((index ^ (index >> 1)) >> pattern.bit) & 1U;
      break;
    }
    case PatternKind::phase_shift:
      value = 0.5 + 0.5 * std::cos(2 * std::numbers::pi * (x - pattern.first_bright_row_px) / pattern.period_px +
                                   pattern.phase_rad);
      break;
  }
  return pattern.level * (pattern.inverted ? 1 - value : value);
}

}  // namespace selvedge::projector
