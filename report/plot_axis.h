// One axis of a plot: its range, the round values at which it is ticked, and where a value lies on it.
#pragma once

#include <string>
#include <vector>

namespace selvedge::report {

class PlotAxis {
 public:
  // values: all that are plotted along it. Those that are not finite, or not above 0 on a log axis, do not count.
  PlotAxis(const std::vector<double>& values, bool is_log);

  // 0 at the axis's start, 1 at its end; NaN where the value cannot be shown.
  double place(double value) const;

  const std::vector<double>& ticks() const { return ticks_; }
  std::string label(double tick) const;

 private:
  double scaled(double value) const;
  void tick_linear();
  void tick_log();

  bool is_log_;
  double low_ = 0, high_ = 1;  // in scaled values: decimal logarithms on a log axis
  double step_ = 0;
  std::vector<double> ticks_;
};

}  // namespace selvedge::report
