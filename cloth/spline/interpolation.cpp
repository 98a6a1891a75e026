#include "cloth/spline/interpolation.h"

#include <algorithm>

namespace selvedge::cloth::spline {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd factors_at_greville(const Basis& basis) {
  MatrixXd a = MatrixXd::Zero(basis.count(), basis.count());
  for (int i = 0; i < basis.count(); ++i) {
    const Alive alive = basis.at(basis.greville(i));
    for (int k = 0; k <= kDegree; ++k) a(i, alive.first + k) = alive.of[0][static_cast<size_t>(k)];
  }
  for (Index k = 0; k < a.rows(); ++k)
    for (Index i = k + 1; i < std::min(a.rows(), k + kDegree + 1); ++i) {
      a(i, k) /= a(k, k);
      for (Index j = k + 1; j < std::min(a.cols(), k + kDegree + 1); ++j) a(i, j) -= a(i, k) * a(k, j);
    }
  return a;
}

// Solves for runs of `length` numbers, the first of each `step` after that of the one before.
void eliminate(const MatrixXd& factors, double* first, Index length, Index step) {
  const auto run = [&](Index i) { return Eigen::Map<Eigen::VectorXd>(first + i * step, length); };
  for (Index i = 0; i < factors.rows(); ++i)
    for (Index j = std::max<Index>(0, i - kDegree); j < i; ++j)
      if (factors(i, j) != 0) run(i) -= factors(i, j) * run(j);
  for (Index i = factors.rows() - 1; i >= 0; --i) {
    for (Index j = i + 1; j < std::min(factors.cols(), i + kDegree + 1); ++j)
      if (factors(i, j) != 0) run(i) -= factors(i, j) * run(j);
    run(i) /= factors(i, i);
  }
}

}  // namespace

Interpolation::Interpolation(const Basis& u, const Basis& v)
    : along_u_(factors_at_greville(u)), along_v_(factors_at_greville(v)) {}

void Interpolation::solve(Eigen::Matrix3Xd& places) const {
  const Index row = 3 * along_u_.rows();  // numbers of a row of control points
  for (Index r = 0; r < along_v_.rows(); ++r) eliminate(along_u_, places.data() + r * row, 3, 3);
  eliminate(along_v_, places.data(), row, row);
}

}  // namespace selvedge::cloth::spline
