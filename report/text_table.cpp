#include "report/text_table.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace selvedge::report {

namespace {

size_t width(const std::string& text) {
  return static_cast<size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

bool is_numeric(const std::string& text) {
  if (text.empty() || text == "-" || text == "–") return true;
  const size_t sign = text[0] == '-' || text[0] == '+' ? 1 : 0;
  return sign < text.size() && text[sign] >= '0' && text[sign] <= '9';
}

std::string padded(const std::string& text, size_t to, bool right) {
  const std::string fill(to > width(text) ? to - width(text) : 0, ' ');
  return right ? fill + text : text + fill;
}

std::string without_end_blanks(std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  return line + "\n";
}

}  // namespace

std::string text_table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows) {
  std::vector<size_t> widths;
  std::vector<bool> right(header.size(), true);
  for (const std::string& name : header) widths.push_back(width(name));
  for (const auto& row : rows)
    for (size_t c = 0; c < header.size() && c < row.size(); ++c) {
      widths[c] = std::max(widths[c], width(row[c]));
      if (!is_numeric(row[c])) right[c] = false;
    }
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string text;
    for (size_t c = 0; c < header.size(); ++c)
      text += (c ? "  " : "") + padded(c < cells.size() ? cells[c] : "", widths[c], right[c]);
    return without_end_blanks(text);
  };
  std::string text = line(header), rule;
  for (size_t c = 0; c < header.size(); ++c) rule += (c ? "  " : "") + std::string(widths[c], '-');
  text += rule + "\n";
  for (const auto& row : rows) text += line(row);
  return text;
}

std::string short_number(double value, int digits) {
  if (!std::isfinite(value)) return std::isnan(value) ? "–" : value > 0 ? "∞" : "-∞";
  const double size = std::abs(value);
  if (size != 0 && (size < 1e-4 || size >= 1e7)) return fmt::format("{:.{}g}", value, digits);
  const int before = size < 1 ? 1 : static_cast<int>(std::floor(std::log10(size))) + 1;
  const int lead = size > 0 && size < 1 ? static_cast<int>(-std::floor(std::log10(size))) - 1 : 0;
  std::string text = fmt::format("{:.{}f}", value, std::max(0, size < 1 ? digits + lead : digits - before));
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text;
}

}  // namespace selvedge::report
