#include "calib/pattern_step.h"

#include <cmath>
#include <cstdint>

namespace selvedge::calib {

std::vector<PatternStep> calibration_sequence(const ImageSize& projector, const SequenceOptions& options) {
  using Kind = PatternStep::Kind;
  std::vector<PatternStep> sequence{{.kind = Kind::off}};
  for (const double level : {0.2, 0.4, 0.6, 0.8, 1.0})
    sequence.push_back({.kind = Kind::solid, .level = level * options.level});
  for (const bool horizontal : {true, false}) {
    const int size = horizontal ? projector.height_px : projector.width_px;
    const int top_bit = static_cast<int>(std::ceil(std::log2(size))) - 1;
    const int low_bit = std::max(0, static_cast<int>(std::floor(std::log2(options.period_px / 4))));
    for (int bit = top_bit; bit >= low_bit; --bit)
      for (const bool inverted : {false, true})
        sequence.push_back({.kind = Kind::gray_code,
                            .horizontal = horizontal,
                            .bit = bit,
                            .inverted = inverted,
                            .level = options.level});
    for (int phase = 0; phase < options.phases; ++phase)
      sequence.push_back({.kind = Kind::phase_shift,
                          .horizontal = horizontal,
                          .period_px = options.period_px,
                          .phase_rad = 2 * M_PI * phase / options.phases,
                          .level = options.level});
  }
  return sequence;
}

namespace {

// off, white, and every bit from `low_bit` up in either direction.
std::vector<PatternStep> code_sequence(const ImageSize& projector, int low_bit, const std::vector<bool>& inversions) {
  using Kind = PatternStep::Kind;
  std::vector<PatternStep> sequence{{.kind = Kind::off}, {.kind = Kind::solid}};
  for (const bool horizontal : {true, false}) {
    const int size = horizontal ? projector.height_px : projector.width_px;
    const int top_bit = static_cast<int>(std::ceil(std::log2(size))) - 1;
    for (int bit = top_bit; bit >= low_bit; --bit)
      for (const bool inverted : inversions)
        sequence.push_back({.kind = Kind::gray_code, .horizontal = horizontal, .bit = bit, .inverted = inverted});
  }
  return sequence;
}

}  // namespace

std::vector<PatternStep> grey_code_sequence(const ImageSize& projector) {
  return code_sequence(projector, 0, {false, true});
}

std::vector<PatternStep> coarse_code_sequence(const ImageSize& projector) {
  return code_sequence(projector, 2, {false});
}

double brightness(const PatternStep& step, double column_px, double row_px) {
  const double x = std::floor((step.horizontal ? row_px : column_px) + 0.5);
  double value = 0;
  switch (step.kind) {
    case PatternStep::Kind::off: return 0;
    case PatternStep::Kind::solid: value = 1; break;
    case PatternStep::Kind::gray_code: {
      const auto index = static_cast<std::uint32_t>(x < 0 ? 0 : x);
      value = ((index ^ (index >> 1)) >> step.bit) & 1U;
      break;
    }
    case PatternStep::Kind::phase_shift:
      value = 0.5 + 0.5 * std::cos(2 * M_PI * (x - step.first_px) / step.period_px + step.phase_rad);
      break;
  }
  return step.level * (step.inverted ? 1 - value : value);
}

}  // namespace selvedge::calib
