// The surface of a spline sheet through given places of its greville_points, for many shapes of one sheet.
//
// One banded system along each direction (four functions are alive at a point). It is totally positive, so that
// elimination without exchanges is stable (de Boor & Pinkus 1977).
#pragma once

#include <Eigen/Core>

#include "cloth/spline/basis.h"

namespace selvedge::cloth::spline {

class Interpolation {
 public:
  Interpolation(const Basis& u, const Basis& v);

  // Places of the greville_points, m, to control points.
  void solve(Eigen::Matrix3Xd& places) const;

 private:
  Eigen::MatrixXd along_u_, along_v_;  // factors: L below the diagonal, U on it and above
};

}  // namespace selvedge::cloth::spline
