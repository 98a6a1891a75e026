#include "material_tests/pull_curve.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "files/bad_input.h"
#include "geometry/order_statistics.h"

namespace selvedge::material_tests {

using Eigen::ArrayXd;
using Eigen::Index;
using trial::Pull;
using trial::Trial;

namespace {

constexpr double kShares[] = {0.01, 0.02, 0.035, 0.05, 0.07, 0.1, 0.14, 0.2, 0.27,
                              0.34, 0.42, 0.5,   0.6,  0.7,  0.8, 0.9,  0.97};  // of the largest force
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// 0 along the warp, 1 along the weft, −1 neither.
int direction_of(const Trial& t) {
  const double a = std::fmod(std::abs(t.tensile->angle_deg), 180.0);
  if (std::min(a, 180 - a) < 1) return 0;
  return std::abs(a - 90) < 1 ? 1 : -1;
}

// Medians of neighbours, so that a gauge's spikes are no turning points.
std::vector<double> smoothed(const std::vector<double>& values) {
  const size_t half = std::max<size_t>(1, values.size() / 200);
  std::vector<double> out(values.size());
  for (size_t i = 0; i < values.size(); ++i) {
    const size_t begin = i < half ? 0 : i - half, end = std::min(values.size(), i + half + 1);
    out[i] = geometry::median(std::vector<double>(values.begin() + static_cast<std::ptrdiff_t>(begin),
                                                  values.begin() + static_cast<std::ptrdiff_t>(end)));
  }
  return out;
}

struct Loading {
  std::vector<double> force;  // smoothed
  size_t top = 0;             // where it is largest
};

Loading loading_of(const Trial& t, const Pull& pull) {
  Loading out{smoothed(pull.force), 0};
  out.top = static_cast<size_t>(std::max_element(out.force.begin(), out.force.end()) - out.force.begin());
  if (!(out.force[out.top] > 0))
    refuse((t.folder / "pull.csv").string(), "found pull {} with a force of {} at most, expected one that pulls",
           pull.number, out.force[out.top]);
  return out;
}

// Median stretch of the samples about a force, on the way there.
double stretch_at(const Pull& pull, const Loading& loading, const std::vector<double>& stretch, double force,
                  double most) {
  const double within = 0.08 * force + 0.003 * most;
  std::vector<double> near;
  for (size_t i = 0; i <= loading.top; ++i)
    if (std::abs(pull.force[i] - force) < within && std::isfinite(stretch[i])) near.push_back(stretch[i]);
  if (!near.empty()) return geometry::median(near);
  // Few samples: between the two that the force lies between.
  for (size_t i = 1; i <= loading.top; ++i) {
    const double a = loading.force[i - 1], b = loading.force[i];
    if (a <= force && force <= b && b > a)
      return stretch[i - 1] + (force - a) / (b - a) * (stretch[i] - stretch[i - 1]);
  }
  return kNaN;
}

double work(const std::vector<double>& force, const std::vector<double>& stretch, size_t begin, size_t end) {
  double sum = 0;
  for (size_t i = begin + 1; i < end; ++i) sum += 0.5 * (force[i] + force[i - 1]) * (stretch[i] - stretch[i - 1]);
  return sum;
}

std::optional<double> loss_of(const Pull& pull, const Loading& loading) {
  constexpr double kBack = 0.2;  // of the largest force: a pull that ends above it did not come back
  if (loading.force.back() > kBack * loading.force[loading.top]) return std::nullopt;
  const size_t n = pull.force.size();
  const double there = work(loading.force, pull.stretch_along, 0, loading.top + 1),
               back = -work(loading.force, pull.stretch_along, loading.top, n);
  if (!(there > 0)) return std::nullopt;
  return 1 - back / there;
}

}  // namespace

std::vector<PullCurve> pull_curves(const std::vector<const Trial*>& strips) {
  std::array<double, 2> reached;  // force per width by every pull of the direction
  reached.fill(std::numeric_limits<double>::infinity());
  for (const Trial* t : strips)
    for (const Pull& pull : t->tensile->pulls) {
      const Loading loading = loading_of(*t, pull);
      if (const int d = direction_of(*t); d >= 0)
        reached[static_cast<size_t>(d)] =
            std::min(reached[static_cast<size_t>(d)], loading.force[loading.top] / t->tensile->width_m);
    }
  std::vector<PullCurve> curves;
  for (const Trial* t : strips) {
    const int d = direction_of(*t);
    if (d < 0) continue;
    for (const Pull& pull : t->tensile->pulls) {
      const Loading loading = loading_of(*t, pull);
      const double most = reached[static_cast<size_t>(d)] * t->tensile->width_m;
      PullCurve c{t->name, pull.number, d, ArrayXd(std::size(kShares)), {}, {}, loss_of(pull, loading)};
      c.along = c.across = c.force;
      for (Index k = 0; k < c.force.size(); ++k) {
        const double force = kShares[k] * most;
        c.force(k) = force / t->tensile->width_m;
        c.along(k) = stretch_at(pull, loading, pull.stretch_along, force, most);
        c.across(k) = stretch_at(pull, loading, pull.stretch_across, force, most);
      }
      curves.push_back(std::move(c));
    }
  }
  return curves;
}

Scatter scatter_of(const std::vector<PullCurve>& curves) {
  constexpr double kLeast = 0.003, kOfOne = 0.01;
  Scatter out;
  for (int d = 0; d < 2; ++d)
    for (size_t channel = 0; channel < 2; ++channel) {
      double squares = 0, degrees = 0;
      for (Index k = 0; k < static_cast<Index>(std::size(kShares)); ++k) {
        std::vector<double> values;
        for (const PullCurve& c : curves) {
          const double v = channel == 0 ? c.along(k) : c.across(k);
          if (c.direction == d && std::isfinite(v)) values.push_back(v);
        }
        double mean = 0;
        for (const double v : values) mean += v / static_cast<double>(values.size());
        for (const double v : values) squares += (v - mean) * (v - mean);
        if (values.size() > 1) degrees += static_cast<double>(values.size() - 1);
      }
      out[static_cast<size_t>(d)][channel] = degrees > 0 ? std::max(kLeast, std::sqrt(squares / degrees)) : kOfOne;
    }
  return out;
}

}  // namespace selvedge::material_tests
