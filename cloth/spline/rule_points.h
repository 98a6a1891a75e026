// The points at which membrane and moments of a spline sheet are looked at, one after another, in double precision.
#pragma once

#include <cmath>

#include <Eigen/Core>

#include "cloth/material.h"
#include "cloth/spline/spline_sheet.h"

namespace selvedge::cloth::spline {

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

inline Eigen::Vector3d sum_of(const PointWeights& w, const double (&weights)[16], const Eigen::Matrix3Xd& y) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < 16; ++k) sum += weights[k] * y.col(w.point[k]);
  return sum;
}

// N/m, of the two directions.
struct MembraneStiffness {
  double ku, kv, coupling, shear;
  explicit MembraneStiffness(const Material& m)
      : ku(m.stretch * std::exp(m.stretch_anisotropy)), kv(m.stretch * std::exp(-m.stretch_anisotropy)),
        coupling(m.coupling * std::sqrt(ku * kv)), shear(m.shear) {}
};

}  // namespace selvedge::cloth::spline
