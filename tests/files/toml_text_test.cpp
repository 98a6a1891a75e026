// What is no TOML is refused by its line, also where the parser's own assertions would end the program.
#include "files/toml_text.h"

#include <gtest/gtest.h>

#include "tests/refusal.h"

namespace selvedge::files {
namespace {

std::string refused(const std::string& text) {
  return refusal_of([&] { parse_toml(text, "rig.toml"); });
}

TEST(TomlText, IsRefusedByLineWhereTheParsersAssertionsFail) {
  EXPECT_EQ(refused("a = 1\n[bus]\n\n[.0]\nb = 2\n"), "rig.toml:4: found text that is not TOML");
  EXPECT_EQ(refused("[=]"), "rig.toml:1: found text that is not TOML");
}

TEST(TomlText, IsRefusedByLineAndColumnWhereTheParserSaysSo) {
  EXPECT_EQ(refused("a = 1\nb 2\n").rfind("rig.toml:2:3: found text that is not TOML: ", 0), 0U) << refused("b 2");
}

TEST(TomlText, IsRead) { EXPECT_EQ(parse_toml("[bus]\nport = 7667\n", "rig.toml")["bus"]["port"].value<int>(), 7667); }

}  // namespace
}  // namespace selvedge::files
