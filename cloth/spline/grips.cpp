#include "cloth/spline/grips.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

namespace selvedge::cloth::spline {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// ∫ N_i and ∫ N_i x/size over the first `size` m of a side, by size.
struct Moments {
  VectorXd zeroth, first;
};

Moments moments_at_start(const Basis& basis, double size) {
  Moments m{VectorXd::Zero(basis.count()), VectorXd::Zero(basis.count())};
  std::vector<double> cuts = {0};
  for (const double at : basis.breaks())
    if (at > 0 && at < size) cuts.push_back(at);
  cuts.push_back(size);
  for (size_t k = 0; k + 1 < cuts.size(); ++k)
    // Three points of Gauss and Legendre are exact for a cubic times x.
    for (const auto& [at, weight] :
         {std::pair{-0.7745966692414834, 5.0 / 18}, {0.0, 4.0 / 9}, {0.7745966692414834, 5.0 / 18}}) {
      const double length = cuts[k + 1] - cuts[k], x = cuts[k] + length * (1 + at) / 2, w = weight * length / size;
      const Alive alive = basis.at(x);
      for (int i = 0; i <= kDegree; ++i) {
        m.zeroth(alive.first + i) += w * alive.of[0][static_cast<size_t>(i)];
        m.first(alive.first + i) += w * alive.of[0][static_cast<size_t>(i)] * x / size;
      }
    }
  return m;
}

Basis mirrored(const Basis& basis) {
  std::vector<double> breaks;
  for (size_t i = basis.breaks().size(); i-- > 0;) breaks.push_back(basis.length_m() - basis.breaks()[i]);
  return Basis(breaks);
}

// Over the unit square, 7 − 6a − 6b takes from a function the value at (0, 0) of the plane nearest to it.
Grip corner_grip(const SplineSheet& sheet, bool right) {
  const Moments u = moments_at_start(right ? mirrored(sheet.u.basis) : sheet.u.basis, sheet.swatch.grip_m),
                v = moments_at_start(sheet.v.basis, sheet.swatch.grip_m);
  Grip grip;
  grip.along = right ? 1 : 0;
  for (int r = 0; r < sheet.rows(); ++r)
    for (int c = 0; c < sheet.columns(); ++c) {
      const double w = 7 * u.zeroth(c) * v.zeroth(r) - 6 * u.first(c) * v.zeroth(r) - 6 * u.zeroth(c) * v.first(r);
      if (w != 0) grip.reads.push_back({sheet.index(right ? sheet.columns() - 1 - c : c, r), w});
    }
  return grip;
}

Grip point_grip(const SplineSheet& sheet, int column, int row, double along, double below_m) {
  return {{{sheet.index(column, row), 1}}, along, below_m};
}

}  // namespace

std::vector<Grip> grips_of(const SplineSheet& sheet, Hold hold) {
  if (hold == Hold::nothing) return {};
  if (hold == Hold::corners) return {corner_grip(sheet, false), corner_grip(sheet, true)};
  std::vector<Grip> grips;
  if (hold == Hold::side_edges) {
    for (int r = 0; r < sheet.rows(); ++r) {
      grips.push_back(point_grip(sheet, 0, r, 0, sheet.v.basis.greville(r)));
      grips.push_back(point_grip(sheet, sheet.columns() - 1, r, 1, sheet.v.basis.greville(r)));
    }
    return grips;
  }
  for (int r = 0; r < (hold == Hold::top_edge_clamped ? 2 : 1); ++r)
    for (int c = 0; c < sheet.columns(); ++c)
      grips.push_back(
          point_grip(sheet, c, r, sheet.u.basis.greville(c) / sheet.swatch.width_m, sheet.v.basis.greville(r)));
  return grips;
}

Eigen::Vector3d held_position(const Grip& grip, const HeldPath& path, const Eigen::Matrix<double, 3, 2>& corners) {
  return corners.col(0) + grip.along * (corners.col(1) - corners.col(0)) + grip.below_m * path.clamp_direction;
}

std::vector<std::vector<Weight>> responses(const SplineSheet& sheet, const std::vector<Grip>& grips,
                                           const Inertia& inertia) {
  const VectorXd& scale = inertia.scale;
  const auto count = static_cast<Index>(grips.size());
  MatrixXd moved(sheet.count(), count);
  for (Index k = 0; k < count; ++k) {
    MatrixXd row = MatrixXd::Zero(sheet.columns(), sheet.rows());
    for (const Weight& w : grips[static_cast<size_t>(k)].reads)
      row(w.point) = w.weight * (scale.size() ? scale(w.point) : 1);
    moved.col(k) = MatrixXd(inertia.inverse_u * row * inertia.inverse_v).reshaped();
  }
  if (scale.size()) moved = scale.asDiagonal() * moved;
  MatrixXd gram = MatrixXd::Zero(count, count);
  for (Index k = 0; k < count; ++k)
    for (const Weight& w : grips[static_cast<size_t>(k)].reads) gram.row(k) += w.weight * moved.row(w.point);
  const MatrixXd out = gram.transpose().fullPivLu().solve(moved.transpose()).transpose();
  std::vector<std::vector<Weight>> list(grips.size());
  for (Index k = 0; k < count; ++k)
    for (Index i = 0; i < out.rows(); ++i)
      if (std::abs(out(i, k)) > 1e-13) list[static_cast<size_t>(k)].push_back({static_cast<int>(i), out(i, k)});
  return list;
}

}  // namespace selvedge::cloth::spline
