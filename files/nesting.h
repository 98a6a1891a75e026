// How deep a JSON or TOML text nests, found before anything is built of it.
//
// Values are copied, printed and destroyed by functions that call themselves once a level, so that a file of a few
// megabytes of brackets would run a program out of stack. Both scans agree with the parsers as far as the text is
// valid; what lies behind the first error is never parsed.
#pragma once

#include <string>
#include <string_view>

namespace selvedge::files {

inline constexpr int deepest_nesting = 64;    // brackets within brackets
inline constexpr int longest_key_parts = 32;  // TOML's a.b.c, each part a table in a table

// Throw BadInput "WHERE:LINE: …" where the text nests deeper than deepest_nesting, or a key has too many parts.
void refuse_deep_json(std::string_view text, const std::string& where);
void refuse_deep_toml(std::string_view text, const std::string& where);

}  // namespace selvedge::files
