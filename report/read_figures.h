// The figures of a report that HtmlReport wrote, to be shown again in another one.
#pragma once

#include <string>
#include <vector>

namespace selvedge::report {

struct ReadFigure {
  bool is_svg = false;
  std::string bytes;    // the SVG text, or those of the PNG file
  std::string caption;  // as it was given, nothing escaped
};

// Figures that stood side by side are one row; one that stood alone is a row of one. What is no such figure is passed
// over.
std::vector<std::vector<ReadFigure>> read_figures(const std::string& html);

}  // namespace selvedge::report
