#include "cloth/spline/energy.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "cloth/spline/lane_run.h"

namespace selvedge::cloth::spline {

namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Triplets = std::vector<Eigen::Triplet<double>>;

// The 16 functions alive at a point of the rule.
struct PointWeights {
  int point[16];
  double u[16], v[16], uu[16], uv[16], vv[16];
  double weight;  // m²
};

template <class Visit>
void for_each_point(const SplineSheet& sheet, const Visit& visit) {
  for (size_t qv = 0; qv < sheet.v.alive.size(); ++qv)
    for (size_t qu = 0; qu < sheet.u.alive.size(); ++qu) {
      const Alive &a = sheet.u.alive[qu], &b = sheet.v.alive[qv];
      PointWeights w;
      w.weight = sheet.u.rule.weight[qu] * sheet.v.rule.weight[qv];
      for (size_t k = 0; k < 16; ++k) {
        const size_t i = k % 4, j = k / 4;
        w.point[k] = sheet.index(a.first + static_cast<int>(i), b.first + static_cast<int>(j));
        w.u[k] = a.of[1][i] * b.of[0][j];
        w.v[k] = a.of[0][i] * b.of[1][j];
        w.uu[k] = a.of[2][i] * b.of[0][j];
        w.uv[k] = a.of[1][i] * b.of[1][j];
        w.vv[k] = a.of[0][i] * b.of[2][j];
      }
      visit(w);
    }
}

Vector3d sum_of(const PointWeights& w, const double (&weights)[16], const Matrix3Xd& y) {
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < 16; ++k) sum += weights[k] * y.col(w.point[k]);
  return sum;
}

struct Stiffness {
  double ku, kv, coupling, shear;
  explicit Stiffness(const Material& m)
      : ku(m.stretch * std::exp(m.stretch_anisotropy)), kv(m.stretch * std::exp(-m.stretch_anisotropy)),
        coupling(m.coupling * std::sqrt(ku * kv)), shear(m.shear) {}
};

double stretch_energy(double stiffness, double stiffening, double strain) {
  return stiffness * (0.5 * strain * strain + stiffening / 3 * std::abs(strain * strain * strain));
}

Eigen::SparseMatrix<double> kronecker(const SplineSheet& sheet, const MatrixXd& u, const MatrixXd& v) {
  Triplets entries;
  for (Index r = 0; r < v.rows(); ++r)
    for (Index s = std::max<Index>(0, r - 3); s <= std::min(v.rows() - 1, r + 3); ++s)
      for (Index c = 0; c < u.rows(); ++c)
        for (Index d = std::max<Index>(0, c - 3); d <= std::min(u.rows() - 1, c + 3); ++d)
          entries.emplace_back(r * u.rows() + c, s * u.rows() + d, u(c, d) * v(r, s));
  Eigen::SparseMatrix<double> out(sheet.count(), sheet.count());
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

// Velocities scaled along the normals so that with the fabric's mass alone they have the energy of fabric and air.
Matrix3Xd with_air(const SplineSheet& sheet, double added_mass, const Eigen::VectorXd& density, const Matrix3Xd& x,
                   Matrix3Xd v) {
  for (int r = 0; r < sheet.rows(); ++r)
    for (int c = 0; c < sheet.columns(); ++c) {
      const Alive a = sheet.u.basis.at(sheet.u.basis.greville(c)), b = sheet.v.basis.at(sheet.v.basis.greville(r));
      Vector3d x_u = Vector3d::Zero(), x_v = x_u;
      for (size_t k = 0; k < 16; ++k) {
        const size_t i = k % 4, j = k / 4;
        const auto at = x.col(sheet.index(a.first + static_cast<int>(i), b.first + static_cast<int>(j)));
        x_u += a.of[1][i] * b.of[0][j] * at;
        x_v += a.of[0][i] * b.of[1][j] * at;
      }
      const Index point = sheet.index(c, r);
      const Vector3d normal = x_u.cross(x_v).normalized();
      v.col(point) += (std::sqrt(1 + added_mass / density(point)) - 1) * normal.dot(v.col(point)) * normal;
    }
  return v;
}

double quadratic(const Eigen::SparseMatrix<double>& matrix, const Matrix3Xd& y) {
  return (y * matrix).cwiseProduct(y).sum();
}

// Slopes of the pulls at a point along u and v by x_u and x_v.
struct PointTangent {
  Matrix3d uu, uv, vv;  // vu: the transpose of uv
};

PointTangent point_tangent(const Vector3d& x_u, const Vector3d& x_v, const Stiffness& k, double stiffening,
                           Convexity convexity) {
  const bool positive = convexity == Convexity::kept_positive;
  const double length_u = x_u.norm(), length_v = x_v.norm(), strain_u = length_u - 1, strain_v = length_v - 1;
  const Vector3d along_u = x_u / length_u, along_v = x_v / length_v;
  const auto one_way = [&](double stiffness, double strain, double other, double length, const Vector3d& along) {
    const double stress = stiffness * strain * (1 + stiffening * std::abs(strain)) + k.coupling * other;
    const double sideways = (positive ? std::max(0.0, stress) : stress) / length;
    const Matrix3d direction = along * along.transpose();
    return Matrix3d(stiffness * (1 + 2 * stiffening * std::abs(strain)) * direction +
                    sideways * (Matrix3d::Identity() - direction));
  };
  PointTangent t;
  t.uu = one_way(k.ku, strain_u, strain_v, length_u, along_u) + k.shear * x_v * x_v.transpose();
  t.vv = one_way(k.kv, strain_v, strain_u, length_v, along_v) + k.shear * x_u * x_u.transpose();
  t.uv = k.coupling * along_u * along_v.transpose() + k.shear * x_v * x_u.transpose();
  if (!positive) t.uv += k.shear * x_u.dot(x_v) * Matrix3d::Identity();
  return t;
}

// The blocks of all pairs of control points up to three apart, row by row: a sparse matrix in its own order.
class Blocks {
 public:
  explicit Blocks(const SplineSheet& sheet) : sheet_(sheet), block_(static_cast<size_t>(sheet.count()) * 49) {
    for (Matrix3d& b : block_) b.setZero();
  }
  Matrix3d& at(int i, int j) {
    const int n = sheet_.columns(), down = j / n - i / n + 3, along = j % n - i % n + 3;
    return block_[static_cast<size_t>(i * 49 + down * 7 + along)];
  }
  // Symmetric, so that rows serve as columns.
  StiffnessMatrix matrix() {
    const int n = sheet_.columns(), rows = sheet_.rows();
    StiffnessMatrix out(3 * sheet_.count(), 3 * sheet_.count());
    out.reserve(Eigen::VectorXi::Constant(3 * sheet_.count(), 147));
    for (int i = 0; i < sheet_.count(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        for (int r = std::max(0, i / n - 3); r <= std::min(rows - 1, i / n + 3); ++r)
          for (int c = std::max(0, i % n - 3); c <= std::min(n - 1, i % n + 3); ++c)
            for (int other = 0; other < 3; ++other)
              out.insert(3 * (r * n + c) + other, 3 * i + axis) = at(i, r * n + c)(axis, other);
    out.makeCompressed();
    return out;
  }

 private:
  const SplineSheet& sheet_;
  std::vector<Matrix3d> block_;
};

void add_bending(const Eigen::SparseMatrix<double>& matrix, double rigidity, Blocks& to) {
  for (int j = 0; j < matrix.outerSize(); ++j)
    for (Eigen::SparseMatrix<double>::InnerIterator at(matrix, j); at; ++at)
      to.at(static_cast<int>(at.row()), j).diagonal().array() += rigidity * at.value();
}

}  // namespace

BendMatrices bend_matrices(const SplineSheet& sheet) {
  return {kronecker(sheet, sheet.u.bend, sheet.v.mass), kronecker(sheet, sheet.u.slope, sheet.v.slope),
          kronecker(sheet, sheet.u.mass, sheet.v.bend)};
}

Energy energy_of(const SplineSheet& sheet, const Material& m, const Vector3d& gravity, const Matrix3Xd& x,
                 const Matrix3Xd& v) {
  const Stiffness k(m);
  Energy e;
  const double bend_uu = m.bend * std::exp(m.bend_anisotropy), bend_vv = m.bend * std::exp(-m.bend_anisotropy);
  for_each_point(sheet, [&](const PointWeights& w) {
    const Vector3d x_u = sum_of(w, w.u, x), x_v = sum_of(w, w.v, x);
    const double eu = x_u.norm() - 1, ev = x_v.norm() - 1;
    e.stretch += w.weight * (stretch_energy(k.ku, m.stretch_stiffening, eu) +
                             stretch_energy(k.kv, m.stretch_stiffening, ev) + k.coupling * eu * ev);
    e.shear += w.weight * 0.5 * k.shear * x_u.dot(x_v) * x_u.dot(x_v);
    if (m.bend_stiffening == 0) return;
    const double squared =
        sum_of(w, w.uu, x).squaredNorm() + 2 * sum_of(w, w.uv, x).squaredNorm() + sum_of(w, w.vv, x).squaredNorm();
    e.bend += w.weight * 0.25 * m.bend * m.bend_stiffening * squared * squared;
  });
  const BendMatrices bend = bend_matrices(sheet);
  e.bend +=
      0.5 * (bend_uu * quadratic(bend.uu, x) + 2 * m.bend * quadratic(bend.uv, x) + bend_vv * quadratic(bend.vv, x));
  const Eigen::VectorXd density = densities(sheet, m);
  const Eigen::VectorXd area = (sheet.u.mass.rowwise().sum() * sheet.v.mass.rowwise().sum().transpose()).reshaped();
  e.gravity = -gravity.dot(x * density.cwiseProduct(area));
  const MatrixXd mass_u = sheet.u.inverse.inverse(), mass_v = sheet.v.inverse.inverse();
  const Eigen::VectorXd scale = (density / m.density).cwiseSqrt();
  const Matrix3Xd felt = m.added_mass == 0 ? v : with_air(sheet, m.added_mass, density, x, v);
  for (int a = 0; a < 3; ++a) {
    const Eigen::VectorXd axis = felt.row(a).transpose().cwiseProduct(scale);
    const MatrixXd y = axis.reshaped(sheet.columns(), sheet.rows());
    e.kinetic += 0.5 * m.density * (mass_u * y * mass_v).cwiseProduct(y).sum();
  }
  return e;
}

StiffnessMatrix tangent(const SplineSheet& sheet, const Material& m, const Matrix3Xd& x, Convexity convexity) {
  const Stiffness k(m);
  Blocks blocks(sheet);
  for_each_point(sheet, [&](const PointWeights& w) {
    const PointTangent t = point_tangent(sum_of(w, w.u, x), sum_of(w, w.v, x), k, m.stretch_stiffening, convexity);
    const Matrix3d vu = t.uv.transpose();
    for (size_t i = 0; i < 16; ++i) {
      const Matrix3d by_u = w.weight * (w.u[i] * t.uu + w.v[i] * vu), by_v = w.weight * (w.u[i] * t.uv + w.v[i] * t.vv);
      for (size_t j = 0; j < 16; ++j) blocks.at(w.point[i], w.point[j]) += w.u[j] * by_u + w.v[j] * by_v;
    }
  });
  const BendMatrices bend = bend_matrices(sheet);
  add_bending(bend.uu, m.bend * std::exp(m.bend_anisotropy), blocks);
  add_bending(bend.uv, 2 * m.bend, blocks);
  add_bending(bend.vv, m.bend * std::exp(-m.bend_anisotropy), blocks);
  return blocks.matrix();
}

}  // namespace selvedge::cloth::spline
