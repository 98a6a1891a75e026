// `./selvedge prove metric`: the angle map recovers stripes of known direction, and agrees with its definition.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "cli/verify/figures.h"
#include "fit/fold_metric.h"

namespace selvedge::cli {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kSize = 200, kRim = 20;

// Square stripes with soft borders; angle_deg: direction across them, counter-clockwise from the right.
render::Image stripes(double angle_deg, double period_px, double noise_grey, std::mt19937& random) {
  std::normal_distribution<double> normal(0, noise_grey);
  render::Image image(kSize, kSize);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const double across = x * std::cos(angle_deg * kDegree) - y * std::sin(angle_deg * kDegree);
      const double shape = std::tanh(2.5 * std::sin(2 * std::numbers::pi * across / period_px));
      image(y, x) = static_cast<unsigned char>(std::clamp(110 + 95 * shape + normal(random), 0.0, 255.0));
    }
  return image;
}

double wrapped(double angle) { return angle - std::numbers::pi * std::round(angle / std::numbers::pi); }

// Largest and root mean square miss, degrees.
std::pair<double, double> misses(fit::FoldMetric& metric, const render::Image& image, double angle_deg) {
  const fit::AngleMap map = metric.angle_map(image);
  double worst = 0, square = 0;
  for (int y = kRim; y < kSize - kRim; ++y)
    for (int x = kRim; x < kSize - kRim; ++x) {
      const double miss = std::abs(wrapped(map.angle_rad[y * kSize + x] - angle_deg * kDegree)) / kDegree;
      worst = std::max(worst, miss);
      square += miss * miss;
    }
  return {worst, std::sqrt(square) / (kSize - 2 * kRim)};
}

}  // namespace

std::vector<Figure> prove_metric(const FigureOptions& options) {
  fit::FoldMetric metric;
  std::mt19937 random(options.seed);
  std::vector<Figure> figures;
  const double step = options.quick ? 15 : 3;
  for (const double period : {10.0, 14.0, 18.0}) {
    double worst = 0, square = 0;
    int count = 0;
    for (double angle = -88; angle <= 90; angle += step) {
      const auto [largest, rms] = misses(metric, stripes(angle, period, 1, random), angle);
      worst = std::max(worst, largest);
      square += rms * rms;
      ++count;
      options.progress((angle + 88) / 178, "stripes of known direction");
    }
    const std::string what = "stripes of " + std::to_string(int(period)) + " px, noise 1 grey level: ";
    figures.push_back({what + "largest miss of any pixel's angle", worst, 0.5, "degrees", Relation::at_most,
                       "required of the metric"});
    figures.push_back({what + "root mean square", std::sqrt(square / count), 0.1, "degrees", Relation::shown, ""});
  }
  return figures;
}

}  // namespace selvedge::cli
