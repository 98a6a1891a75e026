#include "cloth/bend_matrix.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Sparse>

namespace selvedge::cloth {

namespace {

using Sparse = Eigen::SparseMatrix<double, Eigen::RowMajor>;

constexpr double kNothing = 1e-10;  // of the largest entry: rounding of the least squares behind it

// Whether a row is that of `first` with its columns shifted as far as the row is.
bool is_shifted(const kernel::BendMatrix& m, int first, int row, double tolerance) {
  const auto a = static_cast<size_t>(first), b = static_cast<size_t>(row);
  const int count = m.start[a + 1] - m.start[a];
  if (m.start[b + 1] - m.start[b] != count) return false;
  for (int k = 0; k < count; ++k) {
    const auto i = static_cast<size_t>(m.start[a] + k), j = static_cast<size_t>(m.start[b] + k);
    if (m.index[j] - m.index[i] != row - first || std::abs(m.value[j] - m.value[i]) > tolerance) return false;
  }
  return true;
}

Sparse squared_derivatives(const kernel::SheetData& s) {
  const auto second_derivative = [&](const std::vector<double>& weights, double factor) {
    std::vector<Eigen::Triplet<double>> entries;
    for (int i = 0; i < s.vertex_count; ++i)
      for (int k = s.bend.start[static_cast<size_t>(i)]; k < s.bend.start[static_cast<size_t>(i) + 1]; ++k)
        entries.emplace_back(
            i, s.bend.index[static_cast<size_t>(k)],
            std::sqrt(factor * s.vertex_area[static_cast<size_t>(i)]) * weights[static_cast<size_t>(k)]);
    Sparse d(s.vertex_count, s.vertex_count);
    d.setFromTriplets(entries.begin(), entries.end());
    return d;
  };
  const Sparse uu = second_derivative(s.bend.uu, 1), uv = second_derivative(s.bend.uv, 2),
               vv = second_derivative(s.bend.vv, 1);
  return Sparse(uu.transpose()) * uu + Sparse(uv.transpose()) * uv + Sparse(vv.transpose()) * vv;
}

}  // namespace

kernel::BendMatrix make_bend_matrix(const kernel::SheetData& sheet) {
  Sparse q = squared_derivatives(sheet);
  const double nothing = kNothing * q.coeffs().abs().maxCoeff();
  q.prune([nothing](int, int, double value) { return std::abs(value) > nothing; });
  q.makeCompressed();
  kernel::BendMatrix m;
  m.start.assign(q.outerIndexPtr(), q.outerIndexPtr() + q.rows() + 1);
  m.index.assign(q.innerIndexPtr(), q.innerIndexPtr() + q.nonZeros());
  m.value.assign(q.valuePtr(), q.valuePtr() + q.nonZeros());
  for (int row = 0; row < static_cast<int>(q.rows()); ++row) {
    if (m.alike.empty() || !is_shifted(m, m.alike.back().first, row, nothing)) {
      m.alike.push_back({row, 1});
      continue;
    }
    const auto first = m.value.begin() + m.start[static_cast<size_t>(m.alike.back().first)];
    const auto from = m.start[static_cast<size_t>(row)], to = m.start[static_cast<size_t>(row) + 1];
    std::copy(first, first + (to - from), m.value.begin() + from);
    ++m.alike.back().count;
  }
  return m;
}

}  // namespace selvedge::cloth
