// line_plot, bar_plot and interval_plot of report/html.h.
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "report/html.h"
#include "report/plot_axis.h"
#include "report/plot_data.h"
#include "report/svg.h"
#include "report/text_table.h"

namespace selvedge::report {

namespace {

// Told apart on paper too: dark enough to print, each with a dash and a mark of its own.
struct Style {
  const char* colour;
  const char* dash;
};
constexpr std::array<Style, 7> styles = {{{"#1f4e8c", "none"},
                                          {"#c0392b", "7 3"},
                                          {"#1e7d45", "2 3"},
                                          {"#7d3c98", "10 3 2 3"},
                                          {"#b9770e", "4 2"},
                                          {"#2c3e50", "12 4"},
                                          {"#148f92", "1 2"}}};

constexpr double left_px = 68, right_px = 14, top_px = 10, bottom_px = 46, legend_line_px = 18;
constexpr double letter_px = 6.6;

struct Frame {
  double x_px, y_px, width_px, height_px;
};

std::string line(double x1, double y1, double x2, double y2, const char* colour) {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/>\n", x1, y1, x2, y2,
                     colour);
}

std::string mark(size_t index, double x, double y) {
  const char* colour = styles[index % styles.size()].colour;
  constexpr double r = 2.6;
  switch (index % 4) {
    case 0: return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\"/>\n", x, y, r, colour);
    case 1:
      return fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"{}\"/>\n",
                         x - r, y - r, 2 * r, 2 * r, colour);
    case 2:
      return fmt::format("<path d=\"M{:.1f} {:.1f}l{} {}h{}z\" fill=\"{}\"/>\n", x, y - r, r, 2 * r, -2 * r, colour);
    default:
      return fmt::format("<path d=\"M{:.1f} {:.1f}l{} {}m0 {}l{} {}\" fill=\"none\" stroke=\"{}\"/>\n", x - r, y - r,
                         2 * r, 2 * r, -2 * r, -2 * r, 2 * r, colour);
  }
}

std::string axes(const Frame& frame, const PlotAxis& x, const PlotAxis& y, const PlotOptions& options) {
  std::string svg;
  const double bottom = frame.y_px + frame.height_px, right = frame.x_px + frame.width_px;
  for (const double tick : x.ticks()) {
    const double at = frame.x_px + x.place(tick) * frame.width_px;
    svg += line(at, frame.y_px, at, bottom, "#ddd") + line(at, bottom, at, bottom + 4, "#111") +
           text_at(at, bottom + 17, "middle", x.label(tick));
  }
  for (const double tick : y.ticks()) {
    const double at = bottom - y.place(tick) * frame.height_px;
    svg += line(frame.x_px, at, right, at, "#ddd") + line(frame.x_px - 4, at, frame.x_px, at, "#111") +
           text_at(frame.x_px - 7, at + 4, "end", y.label(tick));
  }
  svg += fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" stroke=\"#111\"/>\n",
      frame.x_px, frame.y_px, frame.width_px, frame.height_px);
  const double middle = frame.y_px + frame.height_px / 2;
  svg += text_at(frame.x_px + frame.width_px / 2, bottom + 36, "middle", options.x_label);
  svg += text_at(14, middle, "middle", options.y_label, fmt::format(" transform=\"rotate(-90 14 {:.1f})\"", middle));
  return svg;
}

std::string curve(const Series& series, size_t index, const Frame& frame, const PlotAxis& x, const PlotAxis& y) {
  std::string path, marks;
  bool pen_down = false;
  for (size_t i = 0; i < series.x.size(); ++i) {
    const double at_x = frame.x_px + x.place(series.x[i]) * frame.width_px;
    const double at_y = frame.y_px + (1 - y.place(series.y[i])) * frame.height_px;
    if (!std::isfinite(at_x) || !std::isfinite(at_y)) {
      pen_down = false;
      continue;
    }
    if (series.points_only) marks += mark(index, at_x, at_y);
    else path += fmt::format("{}{:.1f} {:.1f}", pen_down ? "L" : "M", at_x, at_y);
    // A lone point between two gaps would leave no trace as a line.
    const bool alone = !pen_down && (i + 1 == series.x.size() || !std::isfinite(x.place(series.x[i + 1])) ||
                                     !std::isfinite(y.place(series.y[i + 1])));
    if (!series.points_only && alone) marks += mark(index, at_x, at_y);
    pen_down = true;
  }
  const Style& style = styles[index % styles.size()];
  if (!path.empty())
    path = fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\" stroke-dasharray=\"{}\"/>\n",
                       path, style.colour, style.dash);
  return path + marks;
}

// Names from left to right above the plot, in as many lines as they need. Returns the lines' number.
int legend(const std::vector<Series>& series, double width_px, std::string& svg) {
  double x = left_px;
  int lines = 1;
  for (size_t i = 0; i < series.size(); ++i) {
    const size_t letters = static_cast<size_t>(
        std::count_if(series[i].name.begin(), series[i].name.end(), [](char c) { return (c & 0xc0) != 0x80; }));
    const double needed = 40 + letter_px * static_cast<double>(letters) + 14;
    if (x > left_px && x + needed > width_px - right_px) {
      x = left_px;
      ++lines;
    }
    const double y = top_px + legend_line_px * (lines - 0.5);
    const Style& style = styles[i % styles.size()];
    if (series[i].points_only) svg += mark(i, x + 15, y);
    else
      svg += fmt::format("<path d=\"M{:.1f} {:.1f}h30\" stroke=\"{}\" stroke-width=\"1.6\" stroke-dasharray=\"{}\"/>\n",
                         x, y, style.colour, style.dash);
    svg += text_at(x + 36, y + 4, "start", series[i].name);
    x += needed;
  }
  return lines;
}

// Behind everything else; its name at the top of the first.
std::string shaded_spans(const Frame& frame, const PlotAxis& x, const PlotOptions& options) {
  std::string svg;
  for (const auto& [from, to] : options.shaded) {
    const double left = std::clamp(x.place(from), 0.0, 1.0), right = std::clamp(x.place(to), 0.0, 1.0);
    if (!(right > left)) continue;
    const double at = frame.x_px + left * frame.width_px;
    const std::string name = svg.empty() ? text_at(at + 5, frame.y_px + 14, "start", options.shaded_name) : "";
    svg += fmt::format(
               "<rect class=\"shaded\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
               "fill=\"#ece7d8\"/>\n",
               at, frame.y_px, (right - left) * frame.width_px, frame.height_px) +
           name;
  }
  return svg;
}

std::string level_line(const Frame& frame, const PlotAxis& y, const PlotOptions& options) {
  if (!options.level || !std::isfinite(y.place(*options.level))) return "";
  const double at = frame.y_px + (1 - y.place(*options.level)) * frame.height_px, right = frame.x_px + frame.width_px;
  return fmt::format(
             "<path class=\"level\" d=\"M{:.1f} {:.1f}H{:.1f}\" stroke=\"#666\" stroke-width=\"1.4\" "
             "stroke-dasharray=\"8 3 1 3\"/>\n",
             frame.x_px, at, right) +
         text_at(right - 5, at - 5, "end", options.level_name);
}

}  // namespace

std::string line_plot(const std::vector<Series>& series, const PlotOptions& options) {
  std::vector<double> all_x, all_y;
  for (const Series& one : series) {
    if (one.x.size() != one.y.size())
      throw std::invalid_argument(
          fmt::format("line_plot: {}: {} values of x and {} of y", one.name, one.x.size(), one.y.size()));
    for (size_t i = 0; i < one.x.size(); ++i) {
      if (!std::isfinite(one.x[i]) || !std::isfinite(one.y[i])) continue;
      all_x.push_back(one.x[i]);
      all_y.push_back(one.y[i]);
    }
  }
  const bool is_empty = all_x.empty();
  if (options.level && !is_empty) all_y.push_back(*options.level);
  all_x.insert(all_x.end(), options.holds_x.begin(), options.holds_x.end());
  all_y.insert(all_y.end(), options.holds_y.begin(), options.holds_y.end());
  const PlotAxis x(all_x, options.log_x), y(all_y, options.log_y);
  std::string names;
  const bool named = std::any_of(series.begin(), series.end(), [](const Series& s) { return !s.name.empty(); });
  const double above = named ? legend_line_px * legend(series, options.width_px, names) + 6 : 0;
  const Frame frame{left_px, top_px + above, options.width_px - left_px - right_px,
                    options.height_px - top_px - bottom_px};
  std::string svg = open_svg(options.width_px, options.height_px + above) + plot_data({series, options}) + names +
                    shaded_spans(frame, x, options) + axes(frame, x, y, options) + level_line(frame, y, options);
  for (size_t i = 0; i < series.size(); ++i) svg += curve(series[i], i, frame, x, y);
  if (is_empty) svg += text_at(frame.x_px + frame.width_px / 2, frame.y_px + frame.height_px / 2, "middle", "no data");
  return svg + "</svg>\n";
}

std::string bar_plot(const std::vector<std::string>& labels, const std::vector<double>& values,
                     const std::string& x_label) {
  if (labels.size() != values.size())
    throw std::invalid_argument(fmt::format("bar_plot: {} labels and {} values", labels.size(), values.size()));
  constexpr double bar_px = 22, width_px = 640;
  size_t longest = 0;
  for (const std::string& label : labels) longest = std::max(longest, label.size());
  const double names_px = std::min(260.0, 20 + letter_px * static_cast<double>(longest));
  std::vector<double> range = values;
  range.push_back(0);
  const PlotAxis axis(range, false);
  const Frame frame{names_px, top_px, width_px - names_px - 70, bar_px * static_cast<double>(labels.size())};
  const double bottom = frame.y_px + frame.height_px;
  std::string svg = open_svg(width_px, bottom + bottom_px);
  for (const double tick : axis.ticks()) {
    const double at = frame.x_px + axis.place(tick) * frame.width_px;
    svg += line(at, frame.y_px, at, bottom, "#ddd") + text_at(at, bottom + 17, "middle", axis.label(tick));
  }
  for (size_t i = 0; i < labels.size(); ++i) {
    const double y = frame.y_px + bar_px * static_cast<double>(i);
    const double length = std::isfinite(values[i]) ? std::max(0.0, axis.place(values[i])) * frame.width_px : 0;
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#1f4e8c\"/>\n",
                       frame.x_px, y + 3, length, bar_px - 6);
    svg += text_at(frame.x_px - 6, y + bar_px / 2 + 4, "end", labels[i]);
    svg += text_at(frame.x_px + length + 5, y + bar_px / 2 + 4, "start", short_number(values[i], 3));
  }
  svg += line(frame.x_px, frame.y_px, frame.x_px, bottom, "#111");
  svg += text_at(frame.x_px + frame.width_px / 2, bottom + 36, "middle", x_label);
  return svg + "</svg>\n";
}

std::string interval_plot(const std::vector<std::string>& labels, const std::vector<IntervalSeries>& series,
                          const PlotOptions& options) {
  constexpr double bar_px = 15;
  size_t longest = 0;
  for (const std::string& label : labels) longest = std::max(longest, label.size());
  std::vector<double> range;
  std::vector<Series> named;
  for (const IntervalSeries& one : series) {
    if (one.value.size() != labels.size() || one.low.size() != labels.size() || one.high.size() != labels.size())
      throw std::invalid_argument(fmt::format("interval_plot: {}: {} labels and {}, {}, {} numbers", one.name,
                                              labels.size(), one.value.size(), one.low.size(), one.high.size()));
    for (const auto* numbers : {&one.value, &one.low, &one.high})
      range.insert(range.end(), numbers->begin(), numbers->end());
    named.push_back({one.name, {}, {}, true});
  }
  const PlotAxis axis(range, options.log_x);
  std::string names;
  const double above = legend_line_px * legend(named, options.width_px, names) + 6,
               names_px = std::min(260.0, 20 + letter_px * static_cast<double>(longest));
  const double row_px = bar_px * static_cast<double>(series.size()) + 8;
  const Frame frame{names_px, top_px + above, options.width_px - names_px - right_px,
                    row_px * static_cast<double>(labels.size())};
  const double bottom = frame.y_px + frame.height_px;
  std::string svg = open_svg(options.width_px, bottom + bottom_px) + names;
  for (const double tick : axis.ticks()) {
    const double at = frame.x_px + axis.place(tick) * frame.width_px;
    svg += line(at, frame.y_px, at, bottom, "#ddd") + text_at(at, bottom + 17, "middle", axis.label(tick));
  }
  for (size_t i = 0; i < labels.size(); ++i) {
    const double top = frame.y_px + row_px * static_cast<double>(i);
    svg += line(frame.x_px, top, frame.x_px + frame.width_px, top, "#eee") +
           text_at(frame.x_px - 6, top + row_px / 2 + 4, "end", labels[i]);
    for (size_t k = 0; k < series.size(); ++k) {
      const double y = top + 4 + bar_px * (static_cast<double>(k) + 0.5);
      const double from = frame.x_px + axis.place(series[k].low[i]) * frame.width_px,
                   to = frame.x_px + axis.place(series[k].high[i]) * frame.width_px;
      const double at = frame.x_px + axis.place(series[k].value[i]) * frame.width_px;
      if (std::isfinite(from) && std::isfinite(to)) svg += line(from, y, to, y, styles[k % styles.size()].colour);
      if (std::isfinite(at)) svg += mark(k, at, y);
    }
  }
  svg += line(frame.x_px, frame.y_px, frame.x_px, bottom, "#111");
  svg += text_at(frame.x_px + frame.width_px / 2, bottom + 36, "middle", options.x_label);
  return svg + "</svg>\n";
}

}  // namespace selvedge::report
