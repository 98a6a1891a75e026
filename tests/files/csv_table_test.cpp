#include "files/csv_table.h"

#include <cmath>
#include <cstring>
#include <random>

#include <gtest/gtest.h>

#include "files/bad_input.h"
#include "files/whole_file.h"
#include "tests/refusal.h"

namespace selvedge::files {
namespace {

class CsvTest : public testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::path(testing::TempDir()) /
            (std::string("csv_") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".csv");
  }
  void TearDown() override { std::filesystem::remove(path_); }

  CsvTable read(const std::string& text, bool may_be_cut = false) {
    write_whole(path_, text);
    return read_csv(path_, {{"t_s"}, {"x", true}}, may_be_cut);
  }
  // The refusal's text after the path; empty where the file was read.
  std::string refusal(const std::string& text) {
    const std::string said = refusal_of([&] { read(text); });
    return said.empty() ? said : said.substr(path_.string().size());
  }

  std::filesystem::path path_;
};

TEST_F(CsvTest, FindsColumnsByNameInAnyOrder) {
  const CsvTable table = read("x,other,t_s\r\n 1.5 ,7,+0.25\r\n,8,1e-3\r\n\r\n");
  ASSERT_EQ(table.rows(), 2u);
  EXPECT_EQ(table(0, 0), 0.25);
  EXPECT_EQ(table(0, 1), 1.5);
  EXPECT_EQ(table(1, 0), 1e-3);
  EXPECT_TRUE(std::isnan(table(1, 1)));
}

TEST_F(CsvTest, EmptyTableHasNoRows) { EXPECT_EQ(read("t_s,x\n").rows(), 0u); }

TEST_F(CsvTest, RefusesWithLineAndExpectation) {
  EXPECT_EQ(refusal(""), ":1: found an empty file, expected a header line");
  EXPECT_EQ(refusal("t_s,x"), ":1: found \"t_s,x\" and no line break, expected a whole header line");
  EXPECT_EQ(refusal("t_s,y\n"), ":1: found the columns \"t_s,y\", expected also x");
  EXPECT_EQ(refusal("t_s,x,x\n"), ":1: found column x 2 times, expected it once");
  EXPECT_EQ(refusal("t_s,x\n0,1\n1\n"), ":3: found 1 fields, expected 2 as in the header");
  EXPECT_EQ(refusal("t_s,x\n0,1,2\n"), ":2: found 3 fields, expected 2 as in the header");
  EXPECT_EQ(refusal("t_s,x\n,1\n"), ":2: t_s: found an empty field, expected a number");
  EXPECT_EQ(refusal("t_s,x\n0,1\n\n1,1\n"), ":3: t_s: found an empty field, expected a number");
  EXPECT_EQ(refusal("t_s,x\n0,nan\n"), ":2: x: found \"nan\", expected a finite number");
  EXPECT_EQ(refusal("t_s,x\n0,-inf\n"), ":2: x: found \"-inf\", expected a finite number");
  EXPECT_EQ(refusal("t_s,x\n0,1e999\n"), ":2: x: found \"1e999\", expected a finite number");
  EXPECT_EQ(refusal("t_s,x\n0,1.5m\n"), ":2: x: found \"1.5m\", expected a number");
  EXPECT_EQ(refusal(std::string("t_s,x\n0,\0\n", 10)), ":2: x: found \"\\x00\", expected a number");
}

TEST_F(CsvTest, RefusesACutLastLineUnlessTold) {
  EXPECT_NE(refusal("t_s,x\n0,1\n1,0.12").find(":3: found the end of the file inside the line"), std::string::npos);
  EXPECT_EQ(read("t_s,x\n0,1\n1,0.12", true).rows(), 1u);
  EXPECT_EQ(read("t_s,x\n0,1\n1", true).rows(), 1u);
}

TEST_F(CsvTest, NumbersReadBackBitForBit) {
  std::mt19937_64 random(5);
  std::vector<double> values = {0.1, 1.0 / 3, 5e-324, 1.7976931348623157e308, -0.0};
  while (values.size() < 2000) {
    const uint64_t bits = random();
    double value;
    std::memcpy(&value, &bits, sizeof value);
    if (std::isfinite(value)) values.push_back(value);
  }
  std::string text = "t_s,x\n";
  for (const double value : values) {
    append_number(text, value);
    text += ",\n";
  }
  const CsvTable table = read(text);
  ASSERT_EQ(table.rows(), values.size());
  for (size_t i = 0; i < values.size(); ++i) {
    const double read_back = table(i, 0);
    EXPECT_EQ(std::memcmp(&read_back, &values[i], sizeof(double)), 0) << values[i];
  }
}

TEST_F(CsvTest, TimesMayStandStillButNotGoBack) {
  require_times_ascend(read("t_s,x\n0,1\n0,1\n1,1\n"), 0);
  EXPECT_THROW(require_times_ascend(read("t_s,x\n0,1\n1,1\n0.5,1\n"), 0), BadInput);
}

}  // namespace
}  // namespace selvedge::files
