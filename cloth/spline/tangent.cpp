#include "cloth/spline/tangent.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "cloth/kernel/vertex_parts.h"
#include "cloth/spline/rule_points.h"
#include "cloth/stiffening.h"

namespace selvedge::cloth::spline {

namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

// Slopes of the pulls at a point along u and v by x_u and x_v.
struct PointTangent {
  Matrix3d uu, uv, vv;  // vu: the transpose of uv
};

PointTangent point_tangent(const Vector3d& x_u, const Vector3d& x_v, const MembraneStiffness& k, double stiffening,
                           Convexity convexity) {
  const bool positive = convexity == Convexity::kept_positive;
  const double length_u = x_u.norm(), length_v = x_v.norm(), strain_u = length_u - 1, strain_v = length_v - 1;
  const Vector3d along_u = x_u / length_u, along_v = x_v / length_v;
  const auto one_way = [&](double stiffness, double strain, double other, double length, const Vector3d& along) {
    const double stress = stiffness * strain * stretch_factor(stiffening, strain) + k.coupling * other;
    const double sideways = (positive ? std::max(0.0, stress) : stress) / length;
    const Matrix3d direction = along * along.transpose();
    return Matrix3d(stiffness * stretch_slope(stiffening, strain) * direction +
                    sideways * (Matrix3d::Identity() - direction));
  };
  PointTangent t;
  t.uu = one_way(k.ku, strain_u, strain_v, length_u, along_u) + k.shear * x_v * x_v.transpose();
  t.vv = one_way(k.kv, strain_v, strain_u, length_v, along_v) + k.shear * x_u * x_u.transpose();
  t.uv = k.coupling * along_u * along_v.transpose() + k.shear * x_v * x_u.transpose();
  if (!positive) t.uv += k.shear * x_u.dot(x_v) * Matrix3d::Identity();
  return t;
}

}  // namespace

Tangent::Tangent(const SplineSheet& sheet)
    : sheet_(sheet), columns_(sheet.columns()), bend_(bend_matrices(sheet)),
      block_(static_cast<size_t>(sheet.count()) * 28) {}

void Tangent::set(const Material& m, const Matrix3Xd& control, Convexity convexity) {
  for (Matrix3d& b : block_) b.setZero();
  add_membrane(m, control, convexity);
  add_even_bending(m);
  if (m.bend_stiffening != 0 || m.hem_stiffness != 0) add_other_bending(m, control, convexity);
}

void Tangent::add_membrane(const Material& m, const Matrix3Xd& x, Convexity convexity) {
  const MembraneStiffness k(m);
  for_each_point(sheet_, [&](const PointWeights& w) {
    const PointTangent t = point_tangent(sum_of(w, w.u, x), sum_of(w, w.v, x), k, m.stretch_stiffening, convexity);
    const Matrix3d vu = t.uv.transpose();
    for (size_t i = 0; i < 16; ++i) {
      const Matrix3d by_u = w.weight * (w.u[i] * t.uu + w.v[i] * vu), by_v = w.weight * (w.u[i] * t.uv + w.v[i] * t.vv);
      for (size_t j = 0; j <= i; ++j) at(w.point[i], w.point[j]) += w.u[j] * by_u + w.v[j] * by_v;
    }
  });
}

void Tangent::add_even_bending(const Material& m) {
  const auto add = [&](const Eigen::SparseMatrix<double>& matrix, double rigidity) {
    for (int j = 0; j < matrix.outerSize(); ++j)
      for (Eigen::SparseMatrix<double>::InnerIterator entry(matrix, j); entry; ++entry)
        if (entry.row() >= j) at(static_cast<int>(entry.row()), j).diagonal().array() += rigidity * entry.value();
  };
  add(bend_.uu, m.bend * std::exp(m.bend_anisotropy));
  add(bend_.uv, 2 * m.bend);
  add(bend_.vv, m.bend * std::exp(-m.bend_anisotropy));
}

// Moments are B_a c_a (s − 1) x_a, a: uu, uv, vv, c: 1, 2, 1, beside the even ones; s = factor max(0.05, 1 + γ Σ c
// |x_a|²).
void Tangent::add_other_bending(const Material& m, const Matrix3Xd& x, Convexity convexity) {
  const double rigidity[] = {m.bend * std::exp(m.bend_anisotropy), 2 * m.bend, m.bend * std::exp(-m.bend_anisotropy)};
  const double count[] = {1, 2, 1};
  const bool positive = convexity == Convexity::kept_positive;
  size_t point = 0;
  for_each_point(sheet_, [&](const PointWeights& w) {
    const double* second[] = {w.uu, w.uv, w.vv};
    const Vector3d shape[] = {sum_of(w, w.uu, x), sum_of(w, w.uv, x), sum_of(w, w.vv, x)};
    const double linear =
        1 + m.bend_stiffening * (shape[0].squaredNorm() + 2 * shape[1].squaredNorm() + shape[2].squaredNorm());
    const size_t across = sheet_.u.rule.at.size();
    const double factor =
        1 + m.hem_stiffness * cloth::kernel::hem_share(rim_distance(sheet_.swatch, {sheet_.u.rule.at[point % across],
                                                                                    sheet_.v.rule.at[point / across]}),
                                                       m.hem_width_m);
    ++point;
    const double more = factor * std::max(0.05, linear) - 1;
    const bool bends_it = linear > 0.05 && !(positive && m.bend_stiffening < 0);
    const double change = bends_it ? 2 * m.bend_stiffening * factor : 0;
    Matrix3d slope[3][3];
    for (size_t a = 0; a < 3; ++a)
      for (size_t b = 0; b < 3; ++b) {
        const double size = std::sqrt(rigidity[a] * rigidity[b]), counted = std::sqrt(count[a] * count[b]);
        slope[a][b] = w.weight * change * size * counted * shape[a] * shape[b].transpose();
        if (a == b) slope[a][b].diagonal().array() += w.weight * rigidity[a] * more;
      }
    for (size_t i = 0; i < 16; ++i) {
      Matrix3d by[3];
      for (size_t b = 0; b < 3; ++b)
        by[b] = second[0][i] * slope[0][b] + second[1][i] * slope[1][b] + second[2][i] * slope[2][b];
      for (size_t j = 0; j <= i; ++j)
        at(w.point[i], w.point[j]) += second[0][j] * by[0] + second[1][j] * by[1] + second[2][j] * by[2];
    }
  });
}

StiffnessMatrix Tangent::matrix() const {
  const int n = columns_;
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < sheet_.count(); ++i)
    for (int r = std::max(0, i / n - 3); r <= i / n; ++r)
      for (int c = std::max(0, i % n - 3); c <= std::min(n - 1, i % n + 3); ++c) {
        const int j = r * n + c;
        if (j > i) continue;
        for (int a = 0; a < 3; ++a)
          for (int b = 0; b < 3; ++b) {
            entries.emplace_back(3 * i + a, 3 * j + b, at(i, j)(a, b));
            if (j < i) entries.emplace_back(3 * j + b, 3 * i + a, at(i, j)(a, b));
          }
      }
  StiffnessMatrix out(3 * sheet_.count(), 3 * sheet_.count());
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

}  // namespace selvedge::cloth::spline
