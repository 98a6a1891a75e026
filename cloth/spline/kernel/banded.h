// Cholesky's factors of a banded matrix in blocks of 8 × 8, and what they solve for eight right-hand sides at once.
//
// Column by column of blocks, each block from those left of it in its row and in the diagonal's (left-looking, Golub &
// Van Loan 2013, §4.2.9). Each right-hand side is served by the same operations in the same order, whoever is beside
// it.
#pragma once

#include "cloth/spline/kernel/lanes.h"
#include "cloth/spline/kernel/tables.h"

namespace selvedge::cloth::spline::kernel::SELVEDGE_KIND {

inline constexpr int kBlock = 8, kBlockSize = kBlock * kBlock;

// Block (i, j), i ≥ j, columns after one another.
inline double* block_of(const BandedMatrix& m, int i, int j) {
  return m.blocks + (static_cast<long>(j) * (m.reach + 1) + (i - j)) * kBlockSize;
}
inline int last_row(const BandedMatrix& m, int j) { return j + m.reach < m.count ? j + m.reach : m.count - 1; }

// Block (i, j) less the products of the factors' rows i and j left of it.
template <class V>
void subtract_products(const BandedMatrix& m, int i, int j) {
  constexpr int width = sizeof(V) / sizeof(double), vectors = kBlock / width;
  const int first = i - m.reach > 0 ? i - m.reach : 0;
  double* to = block_of(m, i, j);
  for (int from = 0; from < kBlock; from += width) {
    V sum[width][vectors] = {};
    for (int k = first; k < j; ++k) {
      const double *a = block_of(m, i, k), *b = block_of(m, j, k) + from;
      for (int t = 0; t < kBlock; ++t) {
        V column[vectors];
        for (int r = 0; r < vectors; ++r) column[r] = *reinterpret_cast<const V*>(a + kBlock * t + width * r);
        for (int c = 0; c < width; ++c)
          for (int r = 0; r < vectors; ++r) sum[c][r] = fused(same<V>(b[kBlock * t + c]), column[r], sum[c][r]);
      }
    }
    for (int c = 0; c < width; ++c)
      for (int r = 0; r < vectors; ++r) *reinterpret_cast<V*>(to + kBlock * (from + c) + width * r) -= sum[c][r];
  }
}

// The factor of a block of the diagonal and its inverse; false where a pivot is not positive.
inline bool factor_diagonal(double* a, double* inverse) {
  for (int j = 0; j < kBlock; ++j) {
    double pivot = a[kBlock * j + j];
    const double before = pivot;
    for (int k = 0; k < j; ++k) pivot -= a[kBlock * k + j] * a[kBlock * k + j];
    if (!(pivot > 1e-13 * before)) return false;
    const double size = __builtin_sqrt(pivot), one_over = 1 / size;
    a[kBlock * j + j] = size;
    for (int i = j + 1; i < kBlock; ++i) {
      double sum = a[kBlock * j + i];
      for (int k = 0; k < j; ++k) sum -= a[kBlock * k + i] * a[kBlock * k + j];
      a[kBlock * j + i] = sum * one_over;
    }
    for (int i = 0; i < j; ++i) a[kBlock * j + i] = 0;
  }
  for (int j = 0; j < kBlock; ++j)
    for (int i = 0; i < kBlock; ++i) {
      double sum = i == j ? 1 : 0;
      for (int k = j; k < i; ++k) sum -= a[kBlock * k + i] * inverse[kBlock * j + k];
      inverse[kBlock * j + i] = i < j ? 0 : sum / a[kBlock * i + i];
    }
  return true;
}

// block ← block inverseᵀ.
template <class V>
void divide_by_diagonal(double* block, const double* inverse) {
  constexpr int width = sizeof(V) / sizeof(double);
  for (int r = 0; r < kBlock; r += width) {
    V sum[kBlock] = {};
    for (int k = 0; k < kBlock; ++k) {
      const V column = *reinterpret_cast<const V*>(block + kBlock * k + r);
      for (int c = 0; c < kBlock; ++c) sum[c] = fused(same<V>(inverse[kBlock * k + c]), column, sum[c]);
    }
    for (int c = 0; c < kBlock; ++c) *reinterpret_cast<V*>(block + kBlock * c + r) = sum[c];
  }
}

template <class V>
bool factor_banded(const BandedMatrix& m) {
  for (int j = 0; j < m.count; ++j) {
    double* inverse = m.inverses + static_cast<long>(j) * kBlockSize;
    subtract_products<V>(m, j, j);
    if (!factor_diagonal(block_of(m, j, j), inverse)) return false;
    for (int i = j + 1; i <= last_row(m, j); ++i) {
      subtract_products<V>(m, i, j);
      divide_by_diagonal<V>(block_of(m, i, j), inverse);
    }
  }
  return true;
}

// Eight rows of right-hand sides.
template <class V>
struct Rows {
  V row[kBlock];
  static constexpr int width = sizeof(V) / sizeof(double);
  static Rows of(const double* y) {
    Rows out;
    for (int r = 0; r < kBlock; ++r) out.row[r] = *reinterpret_cast<const V*>(y + kBandedSides * r);
    return out;
  }
  void put(double* y) const {
    for (int r = 0; r < kBlock; ++r) *reinterpret_cast<V*>(y + kBandedSides * r) = row[r];
  }
};

// block x, or its transpose times x.
template <class V>
inline Rows<V> times(const double* block, const Rows<V>& x) {
  Rows<V> out{};
  for (int k = 0; k < kBlock; ++k)
    for (int r = 0; r < kBlock; ++r) out.row[r] = fused(same<V>(block[kBlock * k + r]), x.row[k], out.row[r]);
  return out;
}
template <class V>
inline Rows<V> times_transposed(const double* block, const Rows<V>& x) {
  Rows<V> out{};
  for (int r = 0; r < kBlock; ++r)
    for (int k = 0; k < kBlock; ++k) out.row[k] = fused(same<V>(block[kBlock * k + r]), x.row[r], out.row[k]);
  return out;
}

template <class V>
void solve_banded(const BandedMatrix& m, double* y) {
  const auto at = [&](int block, int side) { return y + static_cast<long>(block) * kBlock * kBandedSides + side; };
  for (int side = 0; side < kBandedSides; side += Rows<V>::width) {
    for (int j = 0; j < m.count; ++j) {
      const Rows<V> x = times(m.inverses + static_cast<long>(j) * kBlockSize, Rows<V>::of(at(j, side)));
      x.put(at(j, side));
      for (int i = j + 1; i <= last_row(m, j); ++i) {
        const Rows<V> less = times(block_of(m, i, j), x);
        Rows<V> to = Rows<V>::of(at(i, side));
        for (int r = 0; r < kBlock; ++r) to.row[r] -= less.row[r];
        to.put(at(i, side));
      }
    }
    for (int j = m.count - 1; j >= 0; --j) {
      Rows<V> x = Rows<V>::of(at(j, side));
      for (int i = j + 1; i <= last_row(m, j); ++i) {
        const Rows<V> less = times_transposed(block_of(m, i, j), Rows<V>::of(at(i, side)));
        for (int r = 0; r < kBlock; ++r) x.row[r] -= less.row[r];
      }
      times_transposed(m.inverses + static_cast<long>(j) * kBlockSize, x).put(at(j, side));
    }
  }
}

}  // namespace selvedge::cloth::spline::kernel::SELVEDGE_KIND
