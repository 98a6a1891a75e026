#include "cloth/stiffness.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

namespace selvedge::cloth {

namespace {

using Sparse = StiffnessMatrix;
using Triplets = std::vector<Eigen::Triplet<double>>;

void add_block(Triplets& to, int i, int j, const Eigen::Matrix3d& block) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) to.emplace_back(3 * i + r, 3 * j + c, block(r, c));
}

void add_triangle(const kernel::Triangle& t, const Material& m, const Eigen::Matrix3Xd& x, const Shares& share,
                  Triplets& to) {
  Eigen::Vector3d w_u = Eigen::Vector3d::Zero(), w_v = Eigen::Vector3d::Zero();
  for (int a = 0; a < 3; ++a) {
    w_u += t.gradient_u[a] * x.col(t.vertex[a]);
    w_v += t.gradient_v[a] * x.col(t.vertex[a]);
  }
  const auto along = [&](const Eigen::Vector3d& w, double stiffness) -> Eigen::Matrix3d {
    const double length = w.norm(), geometric = std::max(0.0, 1 - 1 / length);
    const Eigen::Matrix3d direction = w * w.transpose() / (length * length);
    return t.membrane_area * ((share.stiffness * stiffness + share.damping * m.stretch_damping) * direction +
                              share.stiffness * stiffness * geometric * (Eigen::Matrix3d::Identity() - direction));
  };
  const Eigen::Matrix3d u = along(w_u, m.stretch * std::exp(m.stretch_anisotropy)),
                        v = along(w_v, m.stretch * std::exp(-m.stretch_anisotropy));
  const double skew = t.membrane_area * (share.stiffness * m.shear + share.damping * m.shear_damping);
  std::array<Eigen::Vector3d, 3> slope;
  for (size_t a = 0; a < 3; ++a) slope[a] = t.gradient_u[a] * w_v + t.gradient_v[a] * w_u;
  for (size_t a = 0; a < 3; ++a)
    for (size_t b = 0; b < 3; ++b)
      add_block(to, t.vertex[a], t.vertex[b],
                t.gradient_u[a] * t.gradient_u[b] * u + t.gradient_v[a] * t.gradient_v[b] * v +
                    skew * slope[a] * slope[b].transpose());
}

}  // namespace

StiffnessMatrix stiffness_matrix(const Sheet& sheet, const Material& m, const Eigen::VectorXd& mass,
                                 const Eigen::Matrix3Xd& x, const Shares& share, bool with_mass) {
  const kernel::SheetData& s = sheet.data;
  Triplets entries;
  entries.reserve(s.triangles.size() * 81 + s.bend_matrix.value.size() * 3);
  for (const kernel::Triangle& t : s.triangles) add_triangle(t, m, x, share, entries);
  const double bend = share.stiffness * m.bend + share.damping * m.bend_damping;
  for (int i = 0; i < s.vertex_count; ++i) {
    for (int a = 0; a < 3 && with_mass; ++a) entries.emplace_back(3 * i + a, 3 * i + a, mass(i));
    for (int k = s.bend_matrix.start[static_cast<size_t>(i)]; k < s.bend_matrix.start[static_cast<size_t>(i) + 1]; ++k)
      for (int a = 0; a < 3; ++a)
        entries.emplace_back(3 * i + a, 3 * s.bend_matrix.index[static_cast<size_t>(k)] + a,
                             bend * s.bend_matrix.value[static_cast<size_t>(k)]);
  }
  Sparse matrix(3 * s.vertex_count, 3 * s.vertex_count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

void hold_still(const std::vector<char>& is_held, StiffnessMatrix& matrix) {
  for (int c = 0; c < matrix.outerSize(); ++c)
    for (StiffnessMatrix::InnerIterator at(matrix, c); at; ++at)
      if (is_held[static_cast<size_t>(at.row())] || is_held[static_cast<size_t>(at.col())])
        at.valueRef() = at.row() == at.col() ? 1 : 0;
}

}  // namespace selvedge::cloth
