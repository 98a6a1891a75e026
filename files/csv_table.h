// Numbers out of a CSV file: one header line, commas, '.' as the decimal mark, no quotes.
//
// Columns are found by name, in any order; columns that nobody asked for are passed over. Every line must
// have as many fields as the header, every wanted field must be a finite number, and the last line must
// end with a line break: a file cut in the middle of a number looks whole otherwise.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace selvedge::files {

struct CsvColumn {
  std::string name;
  bool may_be_empty = false;  // an empty field reads as NaN
};

struct CsvTable {
  std::filesystem::path path;
  size_t columns = 0;          // the wanted ones
  std::vector<double> values;  // row major

  size_t rows() const { return columns == 0 ? 0 : values.size() / columns; }
  double operator()(size_t row, size_t column) const { return values[row * columns + column]; }
  // "PATH:LINE", for errors; row 0 stands in line 2.
  std::string where(size_t row) const;
};

// last_line_may_be_cut: a file that was being appended to; an unfinished last line is then passed over.
// Throws BadInput naming path and line.
CsvTable read_csv(const std::filesystem::path& path, const std::vector<CsvColumn>& wanted,
                  bool last_line_may_be_cut = false);

// The same of text that was read already; `path` is for errors.
CsvTable parse_csv(const std::filesystem::path& path, std::string_view text, const std::vector<CsvColumn>& wanted);

// The value as an int. Throws BadInput where it is not one; `name` is the column's, for the error.
int whole_number(const CsvTable& table, size_t row, size_t column, const char* name);

// Throws BadInput where `column` (times, s) has a value below the one before.
void require_times_ascend(const CsvTable& table, size_t column);

// Shortest text that reads back as the same double; empty where the value is NaN.
void append_number(std::string& text, double value);

}  // namespace selvedge::files
