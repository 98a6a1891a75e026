// The one error for input that a person can mend: a file, a configuration key, a command-line value or a
// device's answer. Its text names where, what was found and what was expected; the command line prints it
// and exits with 2.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace selvedge {

// The text as UTF-8 that a terminal or a page shows: bytes that are none, and control characters but line breaks, as
// \xNN.
std::string printable(std::string_view text);

class BadInput : public std::runtime_error {
 public:
  explicit BadInput(const std::string& text) : std::runtime_error(printable(text)) {}
};

// Throws BadInput "WHERE: TEXT", the text formatted with fmt.
// where: file with line or key, or device name.
template <class... Arguments>
[[noreturn]] void refuse(const std::string& where, fmt::format_string<Arguments...> text, Arguments&&... arguments) {
  throw BadInput(where + ": " + fmt::format(text, std::forward<Arguments>(arguments)...));
}

// Found text as an error shows it: in quotes, printable, on one line, cut after 60 bytes at most.
std::string in_quotes(std::string_view text);

}  // namespace selvedge
