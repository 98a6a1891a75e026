#include "report/read_figures.h"

#include <optional>
#include <string_view>
#include <utility>

#include "report/base64.h"
#include "report/html.h"

namespace selvedge::report {

namespace {

// What lies between two marks, searched from `at`; moves `at` behind it.
std::optional<std::string_view> between(std::string_view text, std::string_view from, std::string_view to, size_t& at) {
  const size_t begin = text.find(from, at);
  if (begin == std::string_view::npos) return std::nullopt;
  const size_t end = text.find(to, begin + from.size());
  if (end == std::string_view::npos) return std::nullopt;
  at = end + to.size();
  return text.substr(begin + from.size(), end - begin - from.size());
}

std::optional<ReadFigure> read_figure(std::string_view content) {
  size_t at = 0;
  const auto caption = between(content, "<figcaption>", "</figcaption>", at);
  if (!caption) return std::nullopt;
  ReadFigure figure{false, "", unescape_html(*caption)};
  at = 0;
  if (const auto png = between(content, "src=\"data:image/png;base64,", "\"", at)) {
    const auto bytes = from_base64(*png);
    if (!bytes) return std::nullopt;
    figure.bytes = *bytes;
    return figure;
  }
  const size_t begin = content.find("<svg"), end = content.rfind("</svg>");
  if (begin == std::string_view::npos || end == std::string_view::npos || end < begin) return std::nullopt;
  figure.is_svg = true;
  figure.bytes = std::string(content.substr(begin, end - begin)) + "</svg>";
  return figure;
}

}  // namespace

std::vector<std::vector<ReadFigure>> read_figures(const std::string& html) {
  constexpr std::string_view row = "<div class=\"row\">", row_end = "</div>";
  const std::string_view text = html;
  std::vector<std::vector<ReadFigure>> rows;
  size_t at = 0, row_ends = 0;  // of the last row that began
  while (true) {
    const size_t next_row = text.find(row, at), next_figure = text.find("<figure>", at);
    if (next_figure == std::string_view::npos) return rows;
    if (next_row < next_figure) {
      row_ends = text.find(row_end, next_row);
      if (row_ends == std::string_view::npos) return rows;
      rows.emplace_back();
    } else if (next_figure >= row_ends) {
      rows.emplace_back();
    }
    const auto content = between(text, "<figure>", "</figure>", at);
    if (!content) return rows;
    if (auto figure = read_figure(*content)) rows.back().push_back(std::move(*figure));
  }
}

}  // namespace selvedge::report
