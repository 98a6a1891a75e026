// Lines of 120 columns, and C++ as clang-format lays it out.
#include <cstdlib>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "tests/house/house_files.h"
#include "tests/needs_package.h"

namespace selvedge::house {
namespace {

constexpr size_t kColumns = 120;

// Characters, not bytes: every byte of UTF-8 that begins one.
size_t columns_of(const std::string& line) {
  size_t columns = 0;
  for (const char c : line) columns += (static_cast<unsigned char>(c) & 0xc0) != 0x80;
  return columns;
}

// What cannot be broken: a row of a Markdown table, a line that is one link, a table of TOML in one line.
bool may_be_long(const std::string& file, const std::string& line) {
  static const std::regex link(R"(\s*([-*] |#+ |// |# )?(!?\[[^\]]*\]\([^)]*\)|<?https?://\S+)[.,;]?\s*)");
  static const std::regex toml_table(R"(\w+ = \{.*\})");
  if (file.ends_with(".toml") && std::regex_match(line, toml_table)) return true;
  return (file.ends_with(".md") && line.starts_with("|")) || std::regex_match(line, link);
}

TEST(Layout, NoLineIsLongerThan120Columns) {
  const auto checked = files_ending({".cpp", ".h", ".md", ".mjs", ".js", ".sh", ".toml", ".txt", ".cmake"});
  EXPECT_GT(checked.size(), 500u);
  for (const std::string& file : checked) {
    size_t number = 0;
    for (const std::string& line : lines_of(file)) {
      ++number;
      if (columns_of(line) > kColumns && !may_be_long(file, line))
        ADD_FAILURE() << file << ":" << number << ": " << columns_of(line) << " columns, expected at most " << kColumns;
    }
  }
}

TEST(Layout, CppIsAsClangFormatLaysItOut) {
  SELVEDGE_NEEDS(std::system("command -v clang-format-14 > /dev/null 2>&1") == 0, "clang-format-14",
                 "how the C++ is laid out");
  std::string names;
  for (const std::string& file : files_ending({".cpp", ".h"})) names += " '" + file + "'";
  const Ran ran = run("printf '%s\\n'" + names + " | xargs -P 4 -n 40 clang-format-14 --dry-run --Werror 2>&1");
  EXPECT_EQ(ran.status, 0) << ran.output.substr(0, 4000) << "\nclang-format -i FILE lays a file out";
}

}  // namespace
}  // namespace selvedge::house
