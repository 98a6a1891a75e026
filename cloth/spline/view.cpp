#include "cloth/spline/view.h"

namespace selvedge::cloth::spline {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd values_at_even_points(const Basis& basis, Index points) {
  MatrixXd values = MatrixXd::Zero(points, basis.count());
  for (Index i = 0; i < points; ++i) {
    const Alive alive = basis.at(basis.length_m() * static_cast<double>(i) / static_cast<double>(points - 1));
    for (int k = 0; k <= kDegree; ++k) values(i, alive.first + k) = alive.of[0][static_cast<size_t>(k)];
  }
  return values;
}

}  // namespace

View::View(const SplineSheet& sheet, int points_a_cell) {
  const int columns = points_a_cell * sheet.u.basis.cells() + 1, rows = points_a_cell * sheet.v.basis.cells() + 1;
  mesh_ = geometry::make_grid_mesh(sheet.swatch.width_m, sheet.swatch.height_m, columns, rows);
  along_u_ = values_at_even_points(sheet.u.basis, columns);
  along_v_ = values_at_even_points(sheet.v.basis, rows);
}

Eigen::Matrix3Xd View::of(const Eigen::Matrix3Xd& control) const {
  Eigen::Matrix3Xd out(3, along_u_.rows() * along_v_.rows());
  for (int axis = 0; axis < 3; ++axis) {
    const MatrixXd values = Eigen::VectorXd(control.row(axis)).reshaped(along_u_.cols(), along_v_.cols());
    const MatrixXd half = along_u_ * values;
    out.row(axis) = MatrixXd(half * along_v_.transpose()).reshaped().transpose();
  }
  return out;
}

}  // namespace selvedge::cloth::spline
