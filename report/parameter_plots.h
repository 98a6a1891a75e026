// Plots of fitted parameters: where each lies between its bounds, and which rise and fall together. SVG.
#pragma once

#include <string>
#include <vector>

namespace selvedge::report {

// One parameter. Bounds must be finite, and above 0 where is_log; what is not finite of the others is not drawn.
struct ForestRow {
  std::string name, unit;
  double value = 0, low = 0, high = 0;  // with its interval
  double lower_bound = 0, upper_bound = 0;
  double start = 0;
  bool is_log = false;
};

// A line a parameter, from its lower to its upper bound (written at its ends), logarithmic where is_log: the interval
// as a bar, the value as a dot, the start as a ring.
std::string forest_plot(const std::vector<ForestRow>& rows);

// correlation: row by row, labels.size() squared, −1 to 1. Each cell has a colour and its number.
std::string correlation_map(const std::vector<std::string>& labels, const std::vector<double>& correlation);

}  // namespace selvedge::report
