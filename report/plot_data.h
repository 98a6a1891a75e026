// What a plot of lines shows, kept within its SVG: whoever has a report can read the numbers off it, and two plots can
// be drawn anew on the same axes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "report/html.h"

namespace selvedge::report {

struct LinePlot {
  std::vector<Series> series;
  PlotOptions options;
};

// A <metadata> element; five digits of each number.
std::string plot_data(const LinePlot& plot);

// Nothing where an SVG holds no such element, as those of earlier versions, or a damaged one.
std::optional<LinePlot> read_plot(const std::string& svg);

// Both with axes that hold the numbers of either.
std::pair<std::string, std::string> on_same_axes(const LinePlot& a, const LinePlot& b);

}  // namespace selvedge::report
