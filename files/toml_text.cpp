#include "files/toml_text.h"

#include <algorithm>
#include <vector>

#include "files/bad_input.h"
#include "files/nesting.h"
#include "files/whole_file.h"

namespace selvedge::files {

namespace {

struct FailedInParser {};

bool fails_in_parser(std::string_view text) {
  try {
    const toml::table parsed = toml::parse(text);
  } catch (const FailedInParser&) { return true; } catch (const toml::parse_error&) {
  }
  return false;
}

// The line at which the parser gives up: the shortest beginning of the text, in lines, at which it does so.
size_t failing_line(std::string_view text) {
  std::vector<size_t> ends;
  for (size_t end = text.find('\n'); end != text.npos; end = text.find('\n', end + 1)) ends.push_back(end + 1);
  const auto first =
      std::partition_point(ends.begin(), ends.end(), [&](size_t end) { return !fails_in_parser(text.substr(0, end)); });
  return static_cast<size_t>(first - ends.begin()) + 1;
}

}  // namespace

void fail_in_toml_parser() { throw FailedInParser(); }

toml::table parse_toml(std::string_view text, const std::string& where) {
  refuse_deep_toml(text, where);
  try {
    return toml::parse(text, where);
  } catch (const toml::parse_error& error) {
    const auto& begin = error.source().begin;
    refuse(fmt::format("{}:{}:{}", where, begin.line, begin.column), "found text that is not TOML: {}",
           error.description());
  } catch (const FailedInParser&) {
    refuse(fmt::format("{}:{}", where, failing_line(text)), "found text that is not TOML");
  }
}

toml::table read_toml(const std::filesystem::path& path) { return parse_toml(read_whole(path), path.string()); }

}  // namespace selvedge::files
