#include "report/parameter_plots.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "report/html.h"
#include "report/svg.h"
#include "report/text_table.h"

namespace selvedge::report {

namespace {

constexpr double kForestRow = 30, kForestLeft = 225, kForestRight = 545, kForestWidth = 700, kForestTop = 34;
constexpr const char *kForestBlue = "#1f4e8c", *kQuiet = " fill=\"#444\"";

// Share of the way from the lower to the upper bound; NaN where there is none.
double place_between_bounds(const ForestRow& row, double value) {
  const auto scaled = [&](double x) { return row.is_log ? std::log(x) : x; };
  if (!std::isfinite(value) || (row.is_log && value <= 0)) return std::nan("");
  return std::clamp((scaled(value) - scaled(row.lower_bound)) / (scaled(row.upper_bound) - scaled(row.lower_bound)),
                    0.0, 1.0);
}

std::string forest_line(const ForestRow& row, double y) {
  const auto x = [&](double value) {
    return kForestLeft + place_between_bounds(row, value) * (kForestRight - kForestLeft);
  };
  std::string svg =
      text_at(8, y + 4, "start", row.name) +
      text_at(kForestLeft - 8, y + 4, "end", short_number(row.lower_bound, 2), kQuiet) +
      text_at(kForestRight + 8, y + 4, "start",
              fmt::format("{} {}{}", short_number(row.upper_bound, 2), row.unit, row.is_log ? "" : " (linear)"),
              kQuiet);
  svg += fmt::format(R"(<path d="M{:.1f} {:.1f}H{:.1f}M{:.1f} {:.1f}v10M{:.1f} {:.1f}v10" stroke="#999" fill="none"/>)",
                     kForestLeft, y, kForestRight, kForestLeft, y - 5, kForestRight, y - 5);
  if (const double from = x(row.low), to = x(row.high); std::isfinite(from) && std::isfinite(to))
    svg += fmt::format(
        R"(<rect class="interval" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="8" fill="{}" opacity="0.45"/>)", from,
        y - 4, std::max(1.0, to - from), kForestBlue);
  if (const double at = x(row.start); std::isfinite(at))
    svg += fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="4.5" fill="none" stroke="#b05a2a" stroke-width="1.5"/>)",
                       at, y);
  if (const double at = x(row.value); std::isfinite(at))
    svg += fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="4" fill="{}"/>)", at, y, kForestBlue);
  return svg;
}

// White at 0, blue at −1, orange at 1.
std::string colour_of_correlation(double r) {
  const double s = std::min(1.0, std::abs(r));
  const auto mixed = [&](double to) { return static_cast<int>(std::lround(255 + s * (to - 255))); };
  return r < 0 ? fmt::format("rgb({},{},{})", mixed(60), mixed(120), mixed(200))
               : fmt::format("rgb({},{},{})", mixed(225), mixed(125), mixed(40));
}

}  // namespace

std::string forest_plot(const std::vector<ForestRow>& rows) {
  std::string svg = open_svg(kForestWidth, kForestTop + kForestRow * static_cast<double>(rows.size()));
  svg += text_at(kForestLeft - 8, 16, "end", "lower bound", kQuiet) +
         text_at(kForestRight + 8, 16, "start", "upper bound", kQuiet);
  double x = kForestLeft;
  svg += fmt::format(R"(<circle cx="{:.1f}" cy="12" r="4" fill="{}"/>)", x + 6, kForestBlue) +
         text_at(x + 16, 16, "start", "value");
  x += 66;
  svg += fmt::format(R"(<rect x="{:.1f}" y="8" width="26" height="8" fill="{}" opacity="0.45"/>)", x, kForestBlue) +
         text_at(x + 32, 16, "start", "90 % interval");
  x += 126;
  svg += fmt::format(R"(<circle cx="{:.1f}" cy="12" r="4.5" fill="none" stroke="#b05a2a" stroke-width="1.5"/>)", x) +
         text_at(x + 10, 16, "start", "start");
  for (size_t i = 0; i < rows.size(); ++i)
    svg += forest_line(rows[i], kForestTop + kForestRow * (static_cast<double>(i) + 0.5));
  return svg + "</svg>\n";
}

std::string correlation_map(const std::vector<std::string>& labels, const std::vector<double>& correlation) {
  const size_t n = labels.size();
  if (correlation.size() != n * n)
    throw std::invalid_argument(fmt::format("correlation_map: {} labels and {} numbers", n, correlation.size()));
  constexpr double kCell = 52, kNames = 130;
  const double width = kNames + kCell * static_cast<double>(n) + 60,
               height = kNames + kCell * static_cast<double>(n) + 8;
  std::string svg = open_svg(width, height);
  for (size_t i = 0; i < n; ++i) {
    const double at = kNames + kCell * (static_cast<double>(i) + 0.5);
    svg += text_at(kNames - 8, at + 4, "end", labels[i]);
    svg += fmt::format(R"svg(<text x="{0:.1f}" y="{1:.1f}" transform="rotate(-45 {0:.1f} {1:.1f})">{2}</text>)svg", at,
                       kNames - 8, escape_html(labels[i]));
    for (size_t j = 0; j < n; ++j) {
      const double r = correlation[i * n + j];
      svg += fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="{}" height="{}" fill="{}" stroke="#ddd"/>)",
                         kNames + kCell * static_cast<double>(j), at - kCell / 2, kCell, kCell,
                         std::isfinite(r) ? colour_of_correlation(i == j ? 0 : r) : "#eee");
      svg += text_at(kNames + kCell * (static_cast<double>(j) + 0.5), at + 4, "middle",
                     i == j             ? "·"
                     : std::isfinite(r) ? fmt::format("{:+.2f}", r)
                                        : "–",
                     " fill=\"#000\"");
    }
  }
  return svg + "</svg>\n";
}

}  // namespace selvedge::report
