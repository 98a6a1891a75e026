// A report that stands alone as one HTML file: headings with a list of them at the top, paragraphs, tables, inline SVG
// plots and pictures embedded as PNG. Light or dark by the reader's choice; legible in print (white ground, no colour
// without a second mark), on a phone (tables and plots scroll by themselves), by keyboard and read aloud.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "report/verdict.h"

namespace selvedge::report {

// One line of a plot; x and y of equal length. Points with a NaN are gaps.
struct Series {
  std::string name;
  std::vector<double> x, y;
  bool points_only = false;
};

struct PlotOptions {
  std::string x_label, y_label;  // with units
  bool log_x = false, log_y = false;
  int width_px = 640, height_px = 300;
  std::vector<std::pair<double, double>> shaded = {};  // spans of x
  std::optional<double> level = {};                    // a line at this y
  std::string shaded_name = {}, level_name = {};       // for the legend
  std::vector<double> holds_x = {}, holds_y = {};      // what the axes hold beside what is drawn
};

// SVG text with axes, ticks, legend. Series differ in colour and dash.
std::string line_plot(const std::vector<Series>& series, const PlotOptions& options);

// Horizontal bars, one a label; values ≥ 0.
std::string bar_plot(const std::vector<std::string>& labels, const std::vector<double>& values,
                     const std::string& x_label);

// Values with their intervals, one a label; NaN where there is none. low and high: as many as values.
struct IntervalSeries {
  std::string name;
  std::vector<double> value, low, high;
};

// A line a label: each series' interval as a bar with its value marked on it, the series below each other.
std::string interval_plot(const std::vector<std::string>& labels, const std::vector<IntervalSeries>& series,
                          const PlotOptions& options);

class HtmlReport {
 public:
  explicit HtmlReport(std::string title);

  // The head of a report: how far it is to be trusted, as a word and a colour, then the answer, then why no further.
  void verdict(const Verdict& verdict);
  // The hash of what it was made from, for its foot.
  void input(const std::string& hash);
  void heading(const std::string& text);
  void paragraph(const std::string& text);
  void table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);
  // One line of links: what is read, and where it leads (relative to the report).
  void links(const std::vector<std::pair<std::string, std::string>>& to);
  void svg(const std::string& svg_text, const std::string& caption);
  // markup that runs by itself, such as moving_sheets().
  void interactive(const std::string& markup, const std::string& caption);
  // png: the bytes of a PNG file.
  void picture(const std::string& png, const std::string& caption, int width_px = 0);
  // Pictures of equal size side by side, one caption each.
  void picture_row(const std::vector<std::string>& pngs, const std::vector<std::string>& captions);
  // Plots side by side. Embedded as pictures: nothing in them runs, wherever they come from.
  void svg_row(const std::vector<std::string>& svg_texts, const std::vector<std::string>& captions);

  // Whole file or nothing (files::write_whole).
  void write(const std::filesystem::path& path) const;

 private:
  std::string title_, input_;
  std::vector<std::string> headings_;
  int tables_ = 0, figures_ = 0;
  std::string body_;
};

// The command that makes what is written from now on; reports say it at their foot, with the version and the date.
void set_command(const std::string& command_line);

// & < > " escaped, and back.
std::string escape_html(const std::string& text);
std::string unescape_html(std::string_view text);

}  // namespace selvedge::report
