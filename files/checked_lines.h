// Lines of a CSV file that carry their own checksum, so that damage is found line by line and the others still read.
//
// The last column, `crc32`, is the CRC-32 (zlib's) of the line's text before that column's comma, as a decimal number.
// Other readers take it for one column more.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace selvedge::files {

uint32_t crc32_of(std::string_view bytes);

// "a,b" as "a,b,CRC\n".
std::string with_checksum(std::string_view line);

struct CheckedLines {
  std::string text;  // the header and every line that is as it was written
  size_t rows = 0;   // of those, without the header
  bool header_damaged = false;
  bool torn = false;  // the file ends inside a line: damage, or an append that was cut off
  struct Range {
    size_t first = 0, last = 0;  // as an editor counts them; the header is line 1
  };
  std::vector<Range> damaged;  // lines that are not as they were written, the torn one and the header not among them

  bool sound() const { return !header_damaged && !torn && damaged.empty(); }
};

// header: the file's first line as it was written, with its line break; `text` begins with it even where the file does
// not. Throws BadInput where there is no such file, or nothing that can be read as one.
CheckedLines read_checked_lines(const std::filesystem::path& path, std::string_view header);
// The same of text that was read already.
CheckedLines parse_checked_lines(std::string_view text, std::string_view header);

}  // namespace selvedge::files
