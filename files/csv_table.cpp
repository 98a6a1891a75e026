#include "files/csv_table.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>

#include <fmt/ranges.h>

#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::files {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr size_t not_wanted = static_cast<size_t>(-1);

std::string_view trimmed(std::string_view field) {
  while (!field.empty() && (field.front() == ' ' || field.front() == '\t')) field.remove_prefix(1);
  while (!field.empty() && (field.back() == ' ' || field.back() == '\t' || field.back() == '\r'))
    field.remove_suffix(1);
  return field;
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> fields;
  size_t start = 0;
  for (size_t comma; (comma = line.find(',', start)) != std::string_view::npos; start = comma + 1)
    fields.push_back(trimmed(line.substr(start, comma - start)));
  fields.push_back(trimmed(line.substr(start)));
  return fields;
}

// For each field of the header, the index into `wanted`, or not_wanted.
std::vector<size_t> match_header(const std::vector<std::string_view>& header, const std::vector<CsvColumn>& wanted,
                                 const std::string& where) {
  std::vector<size_t> target(header.size(), not_wanted);
  std::vector<std::string> missing;
  for (size_t w = 0; w < wanted.size(); ++w) {
    int found = 0;
    for (size_t h = 0; h < header.size(); ++h)
      if (header[h] == wanted[w].name) {
        target[h] = w;
        ++found;
      }
    if (found == 0) missing.push_back(wanted[w].name);
    if (found > 1) refuse(where, "found column {} {} times, expected it once", wanted[w].name, found);
  }
  if (!missing.empty())
    refuse(where, "found the columns {}, expected also {}", in_quotes(fmt::format("{}", fmt::join(header, ","))),
           fmt::join(missing, ", "));
  return target;
}

// Blank lines at the end of a file are passed over.
std::string_view without_blank_end(std::string_view text) {
  const size_t last = text.find_last_not_of(" \t\r\n");
  if (last == std::string_view::npos) return {};
  const size_t line_end = text.find('\n', last);
  return line_end == std::string_view::npos ? text : text.substr(0, line_end + 1);
}

double parse_number(std::string_view field, const CsvColumn& column, const CsvTable& table, size_t row) {
  if (field.empty()) {
    if (column.may_be_empty) return nan;
    refuse(table.where(row), "{}: found an empty field, expected a number", column.name);
  }
  const std::string_view digits = field.front() == '+' ? field.substr(1) : field;
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const bool whole = end == digits.data() + digits.size();
  if (error == std::errc::invalid_argument || !whole)
    refuse(table.where(row), "{}: found {}, expected a number", column.name, in_quotes(field));
  if (error != std::errc() || !std::isfinite(value))
    refuse(table.where(row), "{}: found {}, expected a finite number", column.name, in_quotes(field));
  return value;
}

void parse_row(std::string_view line, const std::vector<size_t>& target, const std::vector<CsvColumn>& wanted,
               CsvTable& table) {
  const size_t row = table.rows();
  table.values.resize(table.values.size() + wanted.size());
  double* const values = &table.values[row * wanted.size()];
  size_t start = 0, field = 0;
  while (true) {
    const size_t comma = line.find(',', start);
    const size_t length = (comma == std::string_view::npos ? line.size() : comma) - start;
    if (field < target.size() && target[field] != not_wanted)
      values[target[field]] = parse_number(trimmed(line.substr(start, length)), wanted[target[field]], table, row);
    ++field;
    if (comma == std::string_view::npos) break;
    start = comma + 1;
  }
  if (field != target.size())
    refuse(table.where(row), "found {} fields, expected {} as in the header", field, target.size());
}

}  // namespace

std::string CsvTable::where(size_t row) const { return fmt::format("{}:{}", path.string(), row + 2); }

CsvTable read_csv(const std::filesystem::path& path, const std::vector<CsvColumn>& wanted, bool last_line_may_be_cut) {
  const std::string bytes = read_whole(path);
  std::string_view text = bytes;
  if (last_line_may_be_cut && !text.empty()) {
    text = text.substr(0, text.rfind('\n') + 1);  // rfind's npos + 1 is 0
    if (text.empty())
      refuse(path.string() + ":1", "found {} and no line break, expected a whole header line", in_quotes(bytes));
  }
  return parse_csv(path, text, wanted);
}

CsvTable parse_csv(const std::filesystem::path& path, std::string_view text, const std::vector<CsvColumn>& wanted) {
  if (text.substr(0, 3) == "\xef\xbb\xbf") text.remove_prefix(3);
  const std::string first = path.string() + ":1";
  if (text.empty()) refuse(first, "found an empty file, expected a header line");

  CsvTable table{path, wanted.size(), {}};
  const size_t header_end = text.find('\n');
  if (header_end == std::string_view::npos)
    refuse(first, "found {} and no line break, expected a whole header line", in_quotes(text));
  const std::vector<size_t> target = match_header(split(text.substr(0, header_end)), wanted, first);
  text.remove_prefix(header_end + 1);
  text = without_blank_end(text);
  table.values.reserve(text.size() / 8);
  while (!text.empty()) {
    const size_t end = text.find('\n');
    parse_row(text.substr(0, end), target, wanted, table);
    if (end == std::string_view::npos)
      refuse(table.where(table.rows() - 1),
             "found the end of the file inside the line, expected a line break "
             "(the file is cut off)");
    text.remove_prefix(end + 1);
  }
  return table;
}

int whole_number(const CsvTable& table, size_t row, size_t column, const char* name) {
  const double value = table(row, column);
  if (value != std::floor(value) || std::abs(value) > std::numeric_limits<int>::max())
    refuse(table.where(row), "{}: found {}, expected a whole number", name, value);
  return static_cast<int>(value);
}

void require_times_ascend(const CsvTable& table, size_t column) {
  for (size_t row = 1; row < table.rows(); ++row)
    if (table(row, column) < table(row - 1, column))
      refuse(table.where(row), "found time {} s after {} s, expected times that do not go backwards",
             table(row, column), table(row - 1, column));
}

void append_number(std::string& text, double value) {
  if (std::isnan(value)) return;
  char digits[32];
  const auto result = std::to_chars(digits, digits + sizeof digits, value);
  text.append(digits, result.ptr);
}

}  // namespace selvedge::files
