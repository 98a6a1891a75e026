// TOML text in, its table or a refusal out. Brings in toml++; what reads sections and keys needs toml_file.h alone.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace selvedge::files {
// The parser asserts of some texts what does not hold of them, such as a table's name that begins with '='.
[[noreturn]] void fail_in_toml_parser();
}  // namespace selvedge::files

#define TOML_ASSERT(expression) static_cast<void>((expression) || (selvedge::files::fail_in_toml_parser(), false))
#include <toml++/toml.h>

namespace selvedge::files {

// Throws BadInput "WHERE:LINE:COLUMN: …" where the text is not TOML, and where it nests too deep (nesting.h).
toml::table parse_toml(std::string_view text, const std::string& where);

// The same of a file. Throws BadInput where it is missing, too.
toml::table read_toml(const std::filesystem::path& path);

}  // namespace selvedge::files
