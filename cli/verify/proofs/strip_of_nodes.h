// A strip that hangs over an edge, by other equations than material_tests/heavy_strip.h has: n equal rods, a moment at
// each node between them, balanced by Newton's method. Second order in the rods' length.
#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "material_tests/heavy_strip.h"

namespace selvedge::cli {

// 2×(n + 1): along, down. Slopes θ_0 … θ_{n−1} of the rods; at node k between rods k − 1 and k (k = 0: the edge, half a
// rod from a level one) M_k = κ (B + B₂ |κ|), and M_k − M_{k+1} = w h (L − s_{k+½}) cos θ_k.
inline Eigen::Matrix2Xd strip_of_nodes(const material_tests::BendingLaw& law, double weight, double overhang_m, int n) {
  const double h = overhang_m / n;
  std::vector<double> slope(n, 0.0), lower(n), diagonal(n), upper(n), right(n);
  const auto span = [&](int k) { return k == 0 ? h / 2 : h; };
  const auto curvature = [&](int k) { return (slope[k] - (k == 0 ? 0 : slope[k - 1])) / span(k); };
  const auto moment = [&](double c) { return c * (law.bend + law.second_order * std::abs(c)); };
  const auto stiffness = [&](double c) { return law.bend + 2 * law.second_order * std::abs(c); };
  // The weight is put on in ten parts.
  for (int part = 1; part <= 10; ++part)
    for (int iteration = 0; iteration < 30; ++iteration) {
      for (int k = 0; k < n; ++k) {
        const double arm = 0.1 * part * weight * h * (overhang_m - (k + 0.5) * h);
        const bool last = k + 1 == n;
        right[k] = -(moment(curvature(k)) - (last ? 0 : moment(curvature(k + 1))) - arm * std::cos(slope[k]));
        const double before = stiffness(curvature(k)) / span(k), after = last ? 0 : stiffness(curvature(k + 1)) / h;
        lower[k] = k == 0 ? 0 : -before;
        upper[k] = -after;
        diagonal[k] = before + after + arm * std::sin(slope[k]);
      }
      double largest = 0;
      for (int k = 1; k < n; ++k) {  // Thomas
        const double factor = lower[k] / diagonal[k - 1];
        diagonal[k] -= factor * upper[k - 1];
        right[k] -= factor * right[k - 1];
      }
      for (int k = n - 1; k >= 0; --k) {
        right[k] = (right[k] - (k + 1 < n ? upper[k] * right[k + 1] : 0)) / diagonal[k];
        largest = std::max(largest, std::abs(right[k]));
      }
      for (int k = 0; k < n; ++k) slope[k] += right[k];
      if (largest < 1e-13) break;
    }
  Eigen::Matrix2Xd point(2, n + 1);
  point.col(0).setZero();
  for (int k = 0; k < n; ++k)
    point.col(k + 1) = point.col(k) + h * Eigen::Vector2d(std::cos(slope[k]), std::sin(slope[k]));
  return point;
}

inline Eigen::Matrix2Xd every_nth(const Eigen::Matrix2Xd& points, int n) {
  Eigen::Matrix2Xd out(2, points.cols() / n + 1);
  for (Eigen::Index i = 0; i < out.cols(); ++i) out.col(i) = points.col(n * i);
  return out;
}

}  // namespace selvedge::cli
