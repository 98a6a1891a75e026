#include "files/nesting.h"

#include <algorithm>

#include "files/bad_input.h"

namespace selvedge::files {

namespace {

size_t line_of(std::string_view text, size_t at) {
  return 1 + static_cast<size_t>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
}

void open_bracket(int& depth, std::string_view text, size_t at, const std::string& where) {
  if (++depth > deepest_nesting)
    refuse(fmt::format("{}:{}", where, line_of(text, at)), "found values nested deeper than {}, expected at most {}",
           deepest_nesting, deepest_nesting);
}

// Behind the quoted text that begins at `at`, or the end of its line where it does not end there.
size_t behind_quoted(std::string_view text, size_t at, bool escapes) {
  const char quote = text[at];
  for (++at; at < text.size() && text[at] != '\n'; ++at) {
    if (text[at] == quote) return at + 1;
    if (escapes && text[at] == '\\') ++at;
  }
  return std::min(at, text.size());
}

// Behind TOML's text of several lines, which begins at `at` with three quotes and may end in five.
size_t behind_long_quoted(std::string_view text, size_t at, bool escapes) {
  const char quote = text[at];
  const std::string end(3, quote);
  for (at += 3; at < text.size(); ++at) {
    if (text.substr(at, 3) == end) {
      at += 3;
      for (int more = 0; more < 2 && at < text.size() && text[at] == quote; ++more) ++at;
      return at;
    }
    if (escapes && text[at] == '\\') ++at;
  }
  return std::min(at, text.size());
}

size_t behind_toml_text(std::string_view text, size_t at) {
  const bool is_long = text.substr(at, 3) == std::string(3, text[at]), escapes = text[at] == '"';
  return is_long ? behind_long_quoted(text, at, escapes) : behind_quoted(text, at, escapes);
}

bool may_be_in_a_key(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
         c == ' ' || c == '\t';
}

}  // namespace

void refuse_deep_json(std::string_view text, const std::string& where) {
  int depth = 0;
  for (size_t at = 0; at < text.size();) {
    const char c = text[at];
    if (c == '"') {
      at = behind_quoted(text, at, true);
      continue;
    }
    if (c == '[' || c == '{') open_bracket(depth, text, at, where);
    if (c == ']' || c == '}') --depth;
    ++at;
  }
}

void refuse_deep_toml(std::string_view text, const std::string& where) {
  int depth = 0, parts = 1;
  for (size_t at = 0; at < text.size();) {
    const char c = text[at];
    if (c == '"' || c == '\'') {
      at = behind_toml_text(text, at);
      continue;
    }
    if (c == '#') {
      at = std::min(text.find('\n', at), text.size());
      continue;
    }
    if (c == '[' || c == '{') open_bracket(depth, text, at, where);
    if (c == ']' || c == '}') --depth;
    if (c == '.' && ++parts > longest_key_parts)
      refuse(fmt::format("{}:{}", where, line_of(text, at)), "found a key of more than {} parts, expected fewer",
             longest_key_parts);
    if (c != '.' && !may_be_in_a_key(c)) parts = 1;
    ++at;
  }
}

}  // namespace selvedge::files
