#include "files/bad_input.h"

#include <utf8.h>

namespace selvedge {

namespace {

std::string escaped(unsigned char byte) { return fmt::format("\\x{:02x}", byte); }

bool is_control(unsigned char c) { return c < 0x20 || c == 0x7f; }

// The longest beginning of at most `bytes` that ends with a whole character.
std::string_view cut(std::string_view text, size_t bytes) {
  if (text.size() <= bytes) return text;
  while (bytes > 0 && (static_cast<unsigned char>(text[bytes]) & 0xc0) == 0x80) --bytes;
  return text.substr(0, bytes);
}

std::string printable(std::string_view text, bool one_line) {
  std::string shown;
  auto at = text.begin();
  while (at != text.end()) {
    const auto bad = utf8::find_invalid(at, text.end());
    for (; at != bad; ++at) {
      const auto c = static_cast<unsigned char>(*at);
      const bool breaks = c == '\n' || c == '\t';
      shown += is_control(c) && (one_line || !breaks) ? escaped(c) : std::string(1, *at);
    }
    if (at != text.end()) shown += escaped(static_cast<unsigned char>(*at++));
  }
  return shown;
}

}  // namespace

std::string printable(std::string_view text) { return printable(text, false); }

std::string in_quotes(std::string_view text) {
  constexpr size_t kLongest = 60;
  const std::string_view begin = cut(text, kLongest);
  return '"' + printable(begin, true) + (begin.size() < text.size() ? "…\"" : "\"");
}

}  // namespace selvedge
