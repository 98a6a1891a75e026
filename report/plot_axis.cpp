#include "report/plot_axis.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "report/text_table.h"

namespace selvedge::report {

namespace {

constexpr int most_steps = 7;

// The next of 1, 2, 5 times a power of ten.
double round_step(double least) {
  const double power = std::pow(10, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * power >= least * (1 - 1e-9)) return factor * power;
  return 10 * power;
}

}  // namespace

PlotAxis::PlotAxis(const std::vector<double>& values, bool is_log) : is_log_(is_log) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double value : values) {
    const double s = scaled(value);
    if (!std::isfinite(s)) continue;
    low = std::min(low, s);
    high = std::max(high, s);
  }
  if (low <= high) {
    // A flat line sits in the middle; rounding noise is not stretched to the full height.
    const double least = is_log ? 0.3 : std::max(1e-9 * std::max(std::abs(low), std::abs(high)), 1e-300);
    const double pad = high - low > least ? 0 : is_log || low == 0 ? 0.5 : 0.05 * std::abs(low);
    low_ = low - pad;
    high_ = high + pad;
  }
  if (is_log) tick_log();
  else tick_linear();
}

double PlotAxis::scaled(double value) const {
  if (!is_log_) return std::isfinite(value) ? value : std::nan("");
  return value > 0 && std::isfinite(value) ? std::log10(value) : std::nan("");
}

double PlotAxis::place(double value) const { return (scaled(value) - low_) / (high_ - low_); }

void PlotAxis::tick_linear() {
  step_ = round_step((high_ - low_) / most_steps);
  low_ = step_ * std::floor(low_ / step_ + 1e-9);
  high_ = step_ * std::ceil(high_ / step_ - 1e-9);
  const long count = std::lround((high_ - low_) / step_);
  for (long i = 0; i <= count; ++i) {
    const double tick = low_ + static_cast<double>(i) * step_;
    ticks_.push_back(std::abs(tick) < 1e-9 * step_ ? 0 : tick);
  }
}

void PlotAxis::tick_log() {
  const double span = high_ - low_;
  const int stride = std::max(1, static_cast<int>(std::ceil(span / most_steps)));
  const std::vector<double> within_decade = span <= 2 ? std::vector<double>{1, 2, 5} : std::vector<double>{1};
  if (span > 2) {
    low_ = stride * std::floor(low_ / stride + 1e-9);
    high_ = stride * std::ceil(high_ / stride - 1e-9);
  }
  for (int decade = static_cast<int>(std::floor(low_)); decade <= static_cast<int>(std::ceil(high_)); ++decade)
    for (const double factor : within_decade) {
      const double at = decade + std::log10(factor);
      const bool on_stride = ((decade - static_cast<int>(std::floor(low_))) % stride) == 0;
      if (on_stride && at >= low_ - 1e-9 && at <= high_ + 1e-9) ticks_.push_back(factor * std::pow(10, decade));
    }
}

std::string PlotAxis::label(double tick) const {
  if (!is_log_ && step_ >= 1e-4 && std::abs(tick) < 1e6) {
    const int decimals = std::max(0, static_cast<int>(std::ceil(-std::log10(step_) - 1e-9)));
    return fmt::format("{:.{}f}", tick, decimals);
  }
  return short_number(tick, 3);
}

}  // namespace selvedge::report
