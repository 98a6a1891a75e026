#include "cloth/spline/energy.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "cloth/kernel/vertex_parts.h"
#include "cloth/spline/lane_run.h"
#include "cloth/spline/rule_points.h"
#include "cloth/stiffening.h"

namespace selvedge::cloth::spline {

namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Triplets = std::vector<Eigen::Triplet<double>>;

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

}  // namespace

BendMatrices bend_matrices(const SplineSheet& sheet) {
  return {kronecker(sheet, sheet.u.bend, sheet.v.mass), kronecker(sheet, sheet.u.slope, sheet.v.slope),
          kronecker(sheet, sheet.u.mass, sheet.v.bend)};
}

Energy energy_of(const SplineSheet& sheet, const Material& m, const Vector3d& gravity, const Matrix3Xd& x,
                 const Matrix3Xd& v) {
  const MembraneStiffness k(m);
  Energy e;
  const double bend_uu = m.bend * std::exp(m.bend_anisotropy), bend_vv = m.bend * std::exp(-m.bend_anisotropy);
  size_t point = 0;
  for_each_point(sheet, [&](const PointWeights& w) {
    const Vector3d x_u = sum_of(w, w.u, x), x_v = sum_of(w, w.v, x);
    const double eu = x_u.norm() - 1, ev = x_v.norm() - 1;
    e.stretch += w.weight * (k.ku * stretch_energy(m.stretch_stiffening, eu) +
                             k.kv * stretch_energy(m.stretch_stiffening, ev) + k.coupling * eu * ev);
    e.shear += w.weight * 0.5 * k.shear * x_u.dot(x_v) * x_u.dot(x_v);
    const Vector2d uv(sheet.u.rule.at[point % sheet.u.rule.at.size()], sheet.v.rule.at[point / sheet.u.rule.at.size()]);
    ++point;
    if (m.bend_stiffening == 0 && m.hem_stiffness == 0) return;
    const double hem = m.hem_stiffness * cloth::kernel::hem_share(rim_distance(sheet.swatch, uv), m.hem_width_m);
    const double uu = sum_of(w, w.uu, x).squaredNorm(), twist = 2 * sum_of(w, w.uv, x).squaredNorm(),
                 vv = sum_of(w, w.vv, x).squaredNorm(), squared = uu + twist + vv;
    e.bend += w.weight * (0.5 * hem * (bend_uu * uu + m.bend * twist + bend_vv * vv) +
                          0.25 * (1 + hem) * m.bend * m.bend_stiffening * squared * squared);
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

}  // namespace selvedge::cloth::spline
