#include "report/text_table.h"

#include <cmath>

#include <gtest/gtest.h>

namespace selvedge::report {
namespace {

TEST(ShortNumber, KeepsWhatCountsAndDropsNoise) {
  EXPECT_EQ(short_number(0), "0");
  EXPECT_EQ(short_number(1.5), "1.5");
  EXPECT_EQ(short_number(0.000123456), "0.0001235");
  EXPECT_EQ(short_number(-123456.7), "-123457");
  EXPECT_EQ(short_number(0.1 + 0.2), "0.3");
  EXPECT_EQ(short_number(5.5e-5), "5.5e-05");
  EXPECT_EQ(short_number(1.23456e9), "1.235e+09");
  EXPECT_EQ(short_number(std::nan("")), "–");
  EXPECT_EQ(short_number(-INFINITY), "-∞");
}

TEST(TextTable, AlignsNumbersRightAndTextLeftByCodePoint) {
  EXPECT_EQ(text_table({"name", "mm"}, {{"µ-long", "1.5"}, {"b", "12"}}),
            "name     mm\n"
            "------  ---\n"
            "µ-long  1.5\n"
            "b        12\n");
}

}  // namespace
}  // namespace selvedge::report
