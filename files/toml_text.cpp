#include "files/toml_text.h"

#include "files/bad_input.h"
#include "files/nesting.h"
#include "files/whole_file.h"

namespace selvedge::files {

toml::table parse_toml(std::string_view text, const std::string& where) {
  refuse_deep_toml(text, where);
  try {
    return toml::parse(text, where);
  } catch (const toml::parse_error& error) {
    const auto& begin = error.source().begin;
    refuse(fmt::format("{}:{}:{}", where, begin.line, begin.column), "found text that is not TOML: {}",
           error.description());
  }
}

toml::table read_toml(const std::filesystem::path& path) { return parse_toml(read_whole(path), path.string()); }

}  // namespace selvedge::files
