#include "files/checked_lines.h"

#include <zlib.h>

#include "files/whole_file.h"

namespace selvedge::files {

uint32_t crc32_of(std::string_view bytes) {
  return static_cast<uint32_t>(::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string with_checksum(std::string_view line) {
  return std::string(line) + ',' + std::to_string(crc32_of(line)) + '\n';
}

namespace {

// line: without its line break.
bool is_as_written(std::string_view line) {
  const size_t comma = line.rfind(',');
  if (comma == std::string_view::npos) return false;
  const std::string_view digits = line.substr(comma + 1);
  // The very digits that with_checksum writes: "007" for "7" is damage too.
  return digits == std::to_string(crc32_of(line.substr(0, comma)));
}

}  // namespace

CheckedLines read_checked_lines(const std::filesystem::path& path, std::string_view header) {
  return parse_checked_lines(read_whole(path), header);
}

CheckedLines parse_checked_lines(std::string_view left, std::string_view header) {
  CheckedLines result;
  result.text = header;
  result.header_damaged = left.substr(0, header.size()) != header;
  for (size_t number = 1; !left.empty(); ++number) {
    const size_t end = left.find('\n');
    const std::string_view line = left.substr(0, end);
    left.remove_prefix(end == std::string_view::npos ? left.size() : end + 1);
    if (number == 1 && !result.header_damaged) continue;
    if (end == std::string_view::npos) {
      result.torn = true;
    } else if (is_as_written(line)) {
      result.text.append(line).push_back('\n');
      ++result.rows;
    } else if (number > 1) {
      if (!result.damaged.empty() && result.damaged.back().last == number - 1) result.damaged.back().last = number;
      else result.damaged.push_back({number, number});
    }
  }
  return result;
}

}  // namespace selvedge::files
