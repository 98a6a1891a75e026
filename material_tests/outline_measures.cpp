#include "material_tests/outline_measures.h"

#include <algorithm>
#include <cmath>

#include "geometry/polyline.h"

namespace selvedge::material_tests {

namespace {

using Eigen::Index;
using Eigen::Matrix2Xd;
using Eigen::VectorXd;

constexpr Index kAngles = 720;
constexpr double kWholeTurn = 2 * M_PI;

// Outermost crossing of each ray from the centre.
VectorXd outermost(const Matrix2Xd& p) {
  VectorXd radius = VectorXd::Zero(kAngles);
  for (Index i = 0, n = p.cols(); i < n; ++i) {
    const Eigen::Vector2d a = p.col(i), b = p.col((i + 1) % n);
    const double from = std::atan2(a.y(), a.x()) / kWholeTurn * kAngles;
    double turned = std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)) / kWholeTurn * kAngles;
    const double low = std::min(from, from + turned), high = std::max(from, from + turned);
    for (Index k = static_cast<Index>(std::ceil(low)); k <= static_cast<Index>(std::floor(high)); ++k) {
      const double share = turned == 0 ? 0 : (static_cast<double>(k) - from) / turned;
      double& r = radius((k % kAngles + kAngles) % kAngles);
      r = std::max(r, (a + share * (b - a)).norm());
    }
  }
  return radius;
}

int count_folds(const VectorXd& radius) {
  Index lowest = 0;
  radius.minCoeff(&lowest);
  int folds = 0;
  bool on_fold = false;
  double low = radius(lowest), high = low;
  for (Index i = 0; i <= radius.size(); ++i) {
    const double r = radius((lowest + i) % radius.size());
    if (on_fold) {
      high = std::max(high, r);
      if (r < high - kFoldDepth_m) {
        on_fold = false;
        low = r;
      }
    } else {
      low = std::min(low, r);
      if (r > low + kFoldDepth_m) {
        on_fold = true;
        high = r;
        ++folds;
      }
    }
  }
  return folds;
}

}  // namespace

double OutlineMeasures::fold_amplitude_m() const {
  double sum = 0;
  for (size_t k = 3; k < harmonics_m.size(); ++k) sum += std::norm(harmonics_m[k]);
  return std::sqrt(sum / 2);
}

OutlineMeasures measure_outline(const Matrix2Xd& outline, double disc_m, double support_m) {
  OutlineMeasures out;
  const double support = M_PI / 4 * support_m * support_m, disc = M_PI / 4 * disc_m * disc_m;
  out.drape_coefficient = (geometry::polygon_area(outline) - support) / (disc - support);
  out.radius_m = outermost(outline);
  out.folds = count_folds(out.radius_m);
  for (int k = 0; k <= kHarmonics; ++k) {
    std::complex<double> sum = 0;
    for (Index i = 0; i < kAngles; ++i) sum += out.radius_m(i) * std::polar(1.0, -kWholeTurn * k * double(i) / kAngles);
    out.harmonics_m.push_back(sum * (k == 0 ? 1.0 : 2.0) / double(kAngles));
  }
  return out;
}

Turned turn_onto(const OutlineMeasures& measured, const OutlineMeasures& other) {
  Turned best{0, INFINITY};
  const Index n = measured.radius_m.size();
  for (Index shift = 0; shift < n; ++shift) {
    double sum = 0;
    for (Index i = 0; i < n; ++i) {
      const double gap = measured.radius_m((i + shift) % n) - other.radius_m(i);
      sum += gap * gap;
    }
    if (const double left = std::sqrt(sum / double(n)); left < best.left_m)
      best = {kWholeTurn * double(shift) / double(n), left};
  }
  return best;
}

}  // namespace selvedge::material_tests
