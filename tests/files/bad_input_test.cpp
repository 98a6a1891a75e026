#include "files/bad_input.h"

#include <gtest/gtest.h>

namespace selvedge {
namespace {

TEST(InQuotes, ShowsWhatIsNoTextAsItsBytes) {
  EXPECT_EQ(in_quotes("Köper"), "\"Köper\"");
  EXPECT_EQ(in_quotes(std::string("a\xff\xc3") + "b\n"), "\"a\\xff\\xc3b\\x0a\"");
}

TEST(InQuotes, IsCutBetweenCharacters) {
  std::string long_text(59, 'x');
  EXPECT_EQ(in_quotes(long_text + "€€"), "\"" + long_text + "…\"");
}

TEST(BadInputText, IsPrintable) {
  EXPECT_STREQ(BadInput("file \xfe: found\ttwo\nlines\x07").what(), "file \\xfe: found\ttwo\nlines\\x07");
}

}  // namespace
}  // namespace selvedge
