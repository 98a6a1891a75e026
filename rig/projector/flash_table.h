// What a DLPC350's firmware holds, since it can only show patterns that were put there beforehand.
//
// The device takes its patterns from three places:
//   solid    the internal test pattern generator, pattern 0, with a foreground colour (any level);
//   lines    the generator's pattern 3, horizontal lines. Their geometry is fixed in the device, so the table
//            says what it is; a level other than 1 is possible;
//   flash    24-bit images in the firmware, each 24 one-bit planes. A plane is addressed by image index and
//            plane number 0 to 23 and shown inverted on request. A lab draws these images and
//            burns them with TI's own tool; nothing here writes firmware.
// Phase-shifted sinusoids need 8 planes each and are left to Gray code with stripes.
//
// The table as TOML, one [[planes]] a run of consecutive planes:
//   [lines]
//   period_px = 16
//   duty = 0.5
//   first_bright_row_px = 0
//   [[planes]]
//   image = 0
//   first_plane = 0
//   kind = "gray_code"            # or "stripes"
//   orientation = "horizontal"
//   bits = [0, 1, 2]              # gray_code; stripes: period_px = [8, 12], duty, first_bright_row_px
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "rig/projector/pattern.h"

namespace selvedge::projector {

struct FlashPlane {
  int image = 0;  // index in the firmware
  int plane = 0;  // 0 to 23
  Pattern pattern;
};

struct FlashTable {
  std::optional<Pattern> lines;  // what test pattern 3 looks like; none: not to be used
  std::vector<FlashPlane> planes;

  // The plane that shows `pattern` or its inverse; null where there is none. Level is not compared.
  const FlashPlane* find(const Pattern& pattern) const;
  // The pattern on a plane; null where the firmware has nothing there.
  const Pattern* at(int image, int plane) const;
};

// Throws BadInput naming file and key: a plane outside 0 to 23, two patterns on one plane, an unknown kind.
FlashTable read_flash_table(const std::filesystem::path& path);

// Gray code of 11 row bits and 10 column bits, and horizontal stripes with periods 4 to 48 px in steps of 2,
// duty one half, first bright row 0: data/projector/flash.toml says the same.
FlashTable standard_flash_table();

}  // namespace selvedge::projector
