#include <gtest/gtest.h>

#include "rig/projector/pattern.h"

namespace selvedge::projector {
namespace {

TEST(Pattern, StripesFollowTheExchangeFormatsRule) {
  const Pattern stripes{.kind = PatternKind::stripes, .period_px = 16, .duty = 0.25, .first_bright_row_px = 3};
  for (int row = -40; row < 100; ++row) {
    const int in_period = ((row - 3) % 16 + 16) % 16;
    EXPECT_EQ(brightness(stripes, 7, row), in_period < 4 ? 1 : 0) << row;
    EXPECT_EQ(brightness(stripes, 7, row + 0.49), brightness(stripes, 700, row - 0.49));  // one mirror
  }
}

TEST(Pattern, GrayCodeChangesOneBitPerPixelAndGivesThePixelBack) {
  for (const auto orientation : {Orientation::horizontal, Orientation::vertical}) {
    unsigned before = 0;
    for (unsigned pixel = 0; pixel < 1140; ++pixel) {
      unsigned code = 0;
      for (int bit = 0; bit < 11; ++bit) {
        const Pattern plane{.kind = PatternKind::gray_code, .orientation = orientation, .bit = bit};
        const double value =
            orientation == Orientation::horizontal ? brightness(plane, 5, pixel) : brightness(plane, pixel, 5);
        code |= static_cast<unsigned>(value) << bit;
      }
      if (pixel > 0) { EXPECT_EQ(__builtin_popcount(code ^ before), 1); }
      before = code;
      for (unsigned shift = 1; shift < 16; shift *= 2) code ^= code >> shift;
      EXPECT_EQ(code, pixel);
    }
  }
}

TEST(Pattern, InvertedAndLevel) {
  const Pattern solid{.kind = PatternKind::solid, .level = 0.4};
  EXPECT_DOUBLE_EQ(brightness(solid, 0, 0), 0.4);
  Pattern dark = solid;
  dark.inverted = true;
  EXPECT_DOUBLE_EQ(brightness(dark, 0, 0), 0);
  EXPECT_DOUBLE_EQ(brightness({}, 0, 0), 0);
  const Pattern wave{.kind = PatternKind::phase_shift, .period_px = 8};
  EXPECT_DOUBLE_EQ(brightness(wave, 0, 8), 1);
  EXPECT_NEAR(brightness(wave, 0, 4), 0, 1e-12);
}

}  // namespace
}  // namespace selvedge::projector
