// Depth of JSON and TOML: refused before anything is built of it, and nothing shallower is.
#include "files/nesting.h"

#include <gtest/gtest.h>

#include "files/json_reader.h"
#include "files/toml_file.h"
#include "files/whole_file.h"
#include "tests/refusal.h"

namespace selvedge::files {
namespace {

std::string repeated(const std::string& part, size_t times) {
  std::string text;
  text.reserve(part.size() * times);
  for (size_t i = 0; i < times; ++i) text += part;
  return text;
}

std::string json_refusal(const std::string& text) {
  return refusal_of([&] { parse_json(text, "trial.json"); });
}
std::string toml_refusal(const std::string& text) {
  return refusal_of([&] { TomlFile::parse(text, "rig.toml", {}); });
}

TEST(Nesting, FourMegabytesOfBracketsAreRefusedByLine) {
  EXPECT_EQ(json_refusal("{\"format\":\n" + repeated("[", 4 << 20)),
            "trial.json:2: found values nested deeper than 64, expected at most 64");
  EXPECT_EQ(json_refusal(repeated("{\"a\":", 1 << 20)),
            "trial.json:1: found values nested deeper than 64, expected at most 64");
  EXPECT_EQ(json_refusal(repeated("[", 1 << 20) + repeated("]", 1 << 20)),
            "trial.json:1: found values nested deeper than 64, expected at most 64");
  EXPECT_EQ(toml_refusal("a = 1\nb = " + repeated("[", 4 << 20)),
            "rig.toml:2: found values nested deeper than 64, expected at most 64");
}

TEST(Nesting, WhatIsNotDeeperIsRead) {
  EXPECT_EQ(json_refusal(repeated("[", 64) + repeated("]", 64)), "");
  EXPECT_EQ(json_refusal("[" + repeated("[],", 1 << 16) + "{}]"), "");
  EXPECT_EQ(json_refusal("\"" + repeated("[{", 100) + "\\\"[\""), "");  // in a text
  EXPECT_EQ(toml_refusal("[a]\nb = " + repeated("[", 60) + repeated("]", 60)), "");
}

TEST(Nesting, LongKeysOfTomlAreRefused) {
  const std::string parts = repeated("a.", 1 << 20) + "a";
  const std::string expected = "found a key of more than 32 parts, expected fewer";
  for (const std::string& text :
       {"[" + parts + "]", parts + " = 1", "x = {b = 1, " + parts + " = 2}",
        // Behind texts that hide what follows from whoever does not take quotes for what they are.
        "x = {b = '''\n\" ''', " + parts + " = 2}", "x = {b = \"\"\"\\\"\"\"\"\"\", " + parts + " = 2}",
        "\"=\"." + repeated("'='.", 40) + "a = 1", "a = 1 # [\"\n" + parts + " = 1"}) {
    const std::string refusal = toml_refusal(text);
    EXPECT_NE(refusal.find(expected), std::string::npos) << text.substr(0, 40) << ": " << refusal;
  }
}

TEST(Nesting, DotsThatAreNoKeysAreLeftAlone) {
  EXPECT_EQ(toml_refusal("[a]\nx = [" + repeated("0.5, ", 1000) + "]"), "");
  EXPECT_EQ(toml_refusal("[a]\nx = \"" + repeated("... ", 100) + "\"\ny = '''\n" + repeated(". ", 100) + "'''\n"), "");
  EXPECT_EQ(toml_refusal("# " + repeated(".", 1000) + "\n[a]\nx = 1\n"), "");
}

}  // namespace
}  // namespace selvedge::files
