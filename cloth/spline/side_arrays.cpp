#include "cloth/spline/side_arrays.h"

namespace selvedge::cloth::spline {

namespace {

// Rows of 2 reach + 1 numbers around the diagonal; zero beyond the matrix.
template <class T>
std::vector<T> band_of(const Eigen::MatrixXd& matrix, Eigen::Index reach) {
  std::vector<T> band;
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    for (Eigen::Index j = i - reach; j <= i + reach; ++j)
      band.push_back(j >= 0 && j < matrix.cols() ? static_cast<T>(matrix(i, j)) : T(0));
  return band;
}

}  // namespace

template <class T>
SideArrays<T>::SideArrays(const Side& side)
    : mass(band_of<T>(side.mass, 3)), slope_product(band_of<T>(side.slope, 3)), bend(band_of<T>(side.bend, 3)),
      inverse(band_of<T>(side.inverse, 6)) {
  for (size_t q = 0; q < side.alive.size(); ++q) {
    first.push_back(side.alive[q].first);
    weight.push_back(static_cast<T>(side.rule.weight[q]));
    for (size_t k = 0; k <= kDegree; ++k) {
      value.push_back(static_cast<T>(side.alive[q].of[0][k]));
      slope.push_back(static_cast<T>(side.alive[q].of[1][k]));
      second.push_back(static_cast<T>(side.alive[q].of[2][k]));
    }
  }
  for (int i = 0; i < side.basis.count(); ++i) {
    const Alive alive = side.basis.at(side.basis.greville(i));
    greville_first.push_back(alive.first);
    area.push_back(static_cast<T>(side.mass.row(i).sum()));
    for (size_t k = 0; k <= kDegree; ++k) {
      greville_value.push_back(static_cast<T>(alive.of[0][k]));
      greville_slope.push_back(static_cast<T>(alive.of[1][k]));
    }
  }
}

template <class T>
kernel::SideTables<T> SideArrays<T>::tables() const {
  kernel::SideTables<T> t;
  t.functions = static_cast<int>(mass.size() / 7);
  t.points = static_cast<int>(first.size());
  t.first = first.data();
  t.value = value.data();
  t.slope = slope.data();
  t.second = second.data();
  t.weight = weight.data();
  t.mass = mass.data();
  t.slope_product = slope_product.data();
  t.bend = bend.data();
  t.inverse = inverse.data();
  t.greville_first = greville_first.data();
  t.greville_value = greville_value.data();
  t.greville_slope = greville_slope.data();
  t.area = area.data();
  return t;
}

template struct SideArrays<float>;
template struct SideArrays<double>;

}  // namespace selvedge::cloth::spline
