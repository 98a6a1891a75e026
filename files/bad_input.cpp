#include "files/bad_input.h"

namespace selvedge {

std::string in_quotes(std::string_view text) {
  constexpr size_t longest = 60;
  std::string shown = "\"";
  for (const unsigned char c : text.substr(0, longest))
    shown += c < 0x20 || c == 0x7f ? fmt::format("\\x{:02x}", c) : std::string(1, static_cast<char>(c));
  return shown + (text.size() > longest ? "…\"" : "\"");
}

}  // namespace selvedge
